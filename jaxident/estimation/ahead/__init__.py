"""From where a robot is to where it will be: filtered start states, and motion ahead of them."""
