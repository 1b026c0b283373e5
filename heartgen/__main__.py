"""`python -m heartgen`: the command line."""

from heartgen.cli import main

if __name__ == "__main__":
    main()
