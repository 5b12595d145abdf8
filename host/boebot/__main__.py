"""`python -m boebot` is the command `boebot`."""

from boebot.cli import main

if __name__ == "__main__":
    main()
