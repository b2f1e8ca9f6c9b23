"""Simulated campaigns: synthetic Doppler of disturbed bodies beside a simulated radar."""
