"""SD² Studio's library: from a moving mesh to radar Doppler, without any window."""

__version__ = "0.1.0"
