"""`python -m ftproc` is `ftproc`."""

from ftproc.cli.main import main

if __name__ == "__main__":
    main()
