"""SD² Studio's window: Qt views over the library ``sd2core``."""
