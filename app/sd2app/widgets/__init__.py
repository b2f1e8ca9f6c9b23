"""Plain widgets that know no model."""
