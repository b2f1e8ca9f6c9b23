from __future__ import annotations

import re

import pytest

from sd2core.denoise.metrics import VelocityError
from tools.documentation.measured import TEXTS
from tools.documentation.paper import findings, linked, table_1

LINES = TEXTS / "paper.md"


def evaluation(**mae_mps: float) -> dict:
    """Part of ``sd2 eval --json``: σ is twice the MAE, and S4 has a spread over trainings."""
    return {
        "groups": [
            {
                "model": name,
                "peak_mae_mps": {"mean": value, "sd": 0.01 if name == "s4" else None},
                "peak_sd_mps": {"mean": 2 * value, "sd": None},
            }
            for name, value in mae_mps.items()
        ]
    }


TOLD = evaluation(none=0.4, s4=0.1, swin=0.125, unet=0.08)
STILL = VelocityError(0.5, 0.6, 0.0, 0.0, 0.0, 0.0, 10, 0, 10)


def test_table_1_sets_ratios_beside_the_papers() -> None:
    head, _, s4, swin, unet, none, still = (
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in table_1(TOLD, STILL).splitlines()
    )
    assert "simulated radar" in head[4]
    assert s4 == ["S4", "1.0126", "1.6329", "", "0.100 ± 0.010", "0.200", "", "−75 %"]
    assert swin[1:] == ["1.1640", "1.8734", "−13 %", "0.125", "0.250", "−20 %", "−69 %"]
    assert unet[1:] == ["1.5835", "2.6549", "−36 %", "0.080", "0.160", "+25 %", "−80 %"]
    assert none[4:] == ["0.400", "0.800", "−75 %", ""]
    assert still[4:] == ["0.500", "0.600", "−80 %", "+25 %"]


def test_findings_tell_the_same_ratios_and_bins() -> None:
    text = findings(TOLD, bin_mps=0.125)
    assert "Swin transformer −20 % here and −13 % in the paper" in text
    assert "U-Net +25 % here and −36 % in the paper" in text
    assert "8.1 to 12.7, ours 0.6 to 1.0." in text


def test_every_place_in_the_program_is_there() -> None:
    text = LINES.read_text("utf-8")
    assert text.count("[[") > 60
    assert "[[" not in linked(text)


@pytest.mark.parametrize(
    "gone", ["[[maps.py:NoSuchMap]]", "[[maps.py:DopplerMap.vanish]]", "[[9999]]"]
)
def test_a_place_that_is_gone_is_refused(gone: str) -> None:
    with pytest.raises(ValueError, match=r"has no|there is no"):
        linked(gone)


@pytest.mark.parametrize("what", [f"eq. {n}" for n in (*range(1, 8), 8, "9, 10")])
def test_every_equation_has_a_line(what: str) -> None:
    assert re.search(rf"^\|[^|]*{what}\b", LINES.read_text("utf-8"), re.MULTILINE)


@pytest.mark.parametrize(
    "what", [*(f"Fig. {n}" for n in range(1, 8)), "Table 1", "Tables 2, 3", "5.1", "5.2", "2.1"]
)
def test_every_figure_table_and_section_has_a_line(what: str) -> None:
    assert re.search(rf"^\|[^|]*{what}\b", LINES.read_text("utf-8"), re.MULTILINE)
