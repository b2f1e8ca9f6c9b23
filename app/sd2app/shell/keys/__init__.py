"""Key bindings and the dialog that edits them."""
