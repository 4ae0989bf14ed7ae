"""`python -m jaxident`."""

from jaxident.cli.main import run

if __name__ == "__main__":
    run()
