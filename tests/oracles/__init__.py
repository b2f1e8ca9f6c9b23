"""What kernels compute, plainly in NumPy: slower, and easier to believe."""
