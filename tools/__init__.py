"""Programs that rebuild bundled files and measured pages; not part of the installed program."""
