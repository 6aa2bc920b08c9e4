"""The program of a plugin's process, which finds formulations by their names in the registry."""

if __name__ == "__main__":
    import sys

    sys.path[:], sys.argv[1:] = sys.argv[1:], []  # See `python_program`.

    from contactverif.isolation.worker import main
    from contactverif.plugins.registry import load_formulation, load_with_defaults

    main(load_formulation, load_with_defaults)
