"""The input that best tells two effects apart."""
