"""``python -m atwood.cli`` is the command line."""

from atwood.cli import main

if __name__ == "__main__":
    main(prog_name="atwood")
