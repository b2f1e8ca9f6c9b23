"""The trade of speed for accuracy: plans, measurements, panel."""
