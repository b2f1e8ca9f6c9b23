"""Link budget: level of a radar's echoes against its noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sd2core.radar_config import RadarConfig


@dataclass(frozen=True)
class LinkBudget:
    """Gains and losses that set the level of echoes against noise.

    Parameters
    ----------
    transmitted_dbm, transmit_gain_dbi, receive_gain_dbi : float
        Defaults of a 60 GHz radar on one chip with antennas in its package: 5 dBm and 5 dBi twice.
    reflected : float
        Share of the power that skin reflects at 60 GHz, 0.38 (permittivity 8 - 11j:
        S. Gabriel, R. W. Lau, C. Gabriel, Phys. Med. Biol. 41, 1996, dry skin).
    noise_figure_db, losses_db : float
        Noise figure of the receiver, and all other losses together.
    full_scale : float
        Amplitude of an echo that fills the converter, in units of square metres of
        smooth area over squared range; in proportion more at wavelengths above 5 mm.
    """

    transmitted_dbm: float = 5.0
    transmit_gain_dbi: float = 5.0
    receive_gain_dbi: float = 5.0
    reflected: float = 0.38
    noise_figure_db: float = 12.0
    losses_db: float = 3.0
    full_scale: float = 0.02

    def full_scale_of(self, config: RadarConfig) -> float:
        """Amplitude that fills a radar's converter; echoes of rough surfaces grow with waves."""
        return self.full_scale * max(1.0, config.wavelength_m / 5e-3)

    def noise_rms(self, config: RadarConfig) -> float:
        """Thermal noise of one real sample, or of I and Q each, in the unit of amplitudes.

        The radar equation with a plate's cross section, 4 π A² / λ²: an amplitude A / R²
        receives P G G A² / ((4 π)² R⁴), of which a real sample has the mean square.
        """
        gain_db = self.transmitted_dbm + self.transmit_gain_dbi + self.receive_gain_dbi
        gain_db += 10.0 * math.log10(self.reflected) - 20.0 * math.log10(4.0 * math.pi)
        bandwidth_hz = (0.5 if config.sampling == "real" else 1.0) * config.sample_rate_hz
        # kT at 290 K is -174 dBm/Hz.
        noise_dbm = -174.0 + 10.0 * math.log10(bandwidth_hz)
        noise_dbm += self.noise_figure_db + self.losses_db
        return math.sqrt(0.5 * 10.0 ** (0.1 * (noise_dbm - gain_db)))
