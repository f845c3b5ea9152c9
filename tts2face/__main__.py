"""``python -m tts2face``: the command line, where the script ``tts2face`` is not on the path."""

from cli.main import main

if __name__ == "__main__":
    main()
