"""The version of relmap; that of the daemon and of all programs (CMakeLists.txt; a test compares)."""

__version__ = "0.2.0"
