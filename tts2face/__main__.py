"""Entry point of ``python -m tts2face``, which runs the command line without the installed script."""

from cli.main import main

if __name__ == "__main__":
    main()
