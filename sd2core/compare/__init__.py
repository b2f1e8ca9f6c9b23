"""How far one moving mesh is from another, and a fit from what is known to be true."""
