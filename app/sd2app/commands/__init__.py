"""Any command of ``sd2`` as a form, and its run in the background."""
