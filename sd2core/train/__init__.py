"""Training of denoisers: runs in folders of their own, and what came of them."""
