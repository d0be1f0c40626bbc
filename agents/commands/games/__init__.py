"""The sub-commands that play games, record them and show them."""
