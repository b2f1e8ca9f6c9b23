"""Networks; what needs torch is imported when one is built."""

from sd2core.denoise.registry import Architecture

SD2_PLUGIN_API = 1

DENOISER = Architecture("sd2_sample.torch_networks.Blur", "one layer", {"width": 3, "skip": True})
CLASSIFIER = Architecture("sd2_sample.torch_networks.Dense", "a layer per frame", {"width": 16})
