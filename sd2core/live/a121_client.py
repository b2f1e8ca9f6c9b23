"""Acconeer's A121 by its exploration tool, as a program of its own that needs nothing of this one.

``python a121_client.py`` reads its settings as one line of JSON, and measures until its input
ends. It writes one line of JSON that says what frames are; then, of every frame, :data:`HEAD` and
its points, int16 real and imaginary part, (sweeps, points, 2). A head whose first value is 1 is
followed by a line of JSON that says what has failed.
"""

from __future__ import annotations

import json
import struct
import sys
import threading
import time
from typing import Any, BinaryIO

HEAD = struct.Struct("<B?dd")
"""0 or 1 for a failure; whether it was saturated; time by the sensor's clock; by this computer's,
monotonic, when it was there."""


def main() -> int:
    """Measure as the first line of the input says."""
    settings = json.loads(sys.stdin.readline())
    out = sys.stdout.buffer
    begun = False
    try:
        from acconeer.exptool import a121

        client = a121.Client.open(**_address(settings["place"]))
        config = a121.SessionConfig.from_json(settings["session"])
        metadata = client.setup_session(config)
        _say(out, **_about(config, metadata))
        client.start_session()
        begun = True
        stop = threading.Event()
        threading.Thread(target=_wait_for_end, args=(stop,), daemon=True).start()
        while not stop.is_set():
            _write(out, client.get_next())
        client.close()
    except Exception as error:  # of whatever kind: it is told where it can be read
        if begun:
            out.write(HEAD.pack(1, False, 0.0, 0.0))
        _say(out, failed=f"{type(error).__name__}: {error}")
        return 1
    return 0


def _address(place: str) -> dict[str, Any]:
    if not place:
        return {}
    if place == "mock":
        return {"mock": True}
    if place.count(".") == 3:
        return {"ip_address": place}
    return {"usb_device": True} if place == "usb" else {"serial_port": place}


def _about(config: Any, metadata: Any) -> dict[str, Any]:
    if config.extended:
        raise ValueError("the session has several sensors or groups")
    sensor = config.sensor_config
    points: list[int] = []
    for one in sensor.subsweeps:
        points += [one.start_point + one.step_length * k for k in range(one.num_points)]
    return {
        "ranges_m": [metadata.base_step_length_m * one for one in points],
        "profiles": [one.profile.value for one in sensor.subsweeps],
        "sweeps": sensor.sweeps_per_frame,
        "sweep_s": 1.0 / (sensor.sweep_rate or metadata.max_sweep_rate),
        "frame_rate_hz": sensor.frame_rate,
    }


def _write(out: BinaryIO, result: Any) -> None:
    import numpy as np

    arrived_s = time.monotonic()
    parts = np.stack([result.frame.real, result.frame.imag], axis=-1)
    out.write(HEAD.pack(0, bool(result.data_saturated), result.tick_time, arrived_s))
    out.write(parts.astype("<i2").tobytes())
    out.flush()


def _wait_for_end(stop: threading.Event) -> None:
    sys.stdin.read()
    stop.set()


def _say(out: BinaryIO, **fields: Any) -> None:
    out.write(json.dumps(fields).encode() + b"\n")
    out.flush()


if __name__ == "__main__":
    sys.exit(main())
