"""Options of operations, each declared once, for command line, plans, forms and checks."""
