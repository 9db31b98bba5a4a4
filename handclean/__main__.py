"""``python -m handclean``."""

from handclean.cli.main import program

if __name__ == "__main__":
    program()
