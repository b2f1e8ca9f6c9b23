"""Reading and writing of foreign file formats."""
