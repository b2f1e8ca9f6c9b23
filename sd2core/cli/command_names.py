"""Names of the commands of ``sd2``, in the order of the help."""

COMMANDS = {
    "info": "what is in a recording, video, mesh, radar or IMU file, map, pairs, data set or model",
    "import": "make a recording from a video, a mesh and a radar capture",
    "set": "change what a recording is made of: its files, its clocks, where its radar is",
    "relink": "find the missing files of a recording in another folder",
    "align": "find the time offset of video and radar from what both saw",
    "fit": "make a moving mesh from a video of a person",
    "refine": "make a mesh of another tool smooth in time",
    "synth": "compute the Doppler that a radar would have measured of a moving mesh",
    "radar": "turn a raw radar capture into a Doppler map, or say what limits it has",
    "listen": "record a radar while it runs, and follow its Doppler map",
    "record": "record a camera and a radar together, on one clock",
    "imu": "what an inertial sensor on the body would measure (simulated)",
    "denoise": "turn a synthetic Doppler map into what a radar would show",
    "classify": "train, evaluate and apply gesture classifiers",
    "labels": "show, count, convert, suggest, compare, draw and cut out labelled spans",
    "pairs": "make pairs of synthetic and radar Doppler to learn from",
    "export": "write a data set to learn from: segments with labels, sensors and provenance",
    "ladder": "measure what accuracy costs on a scene, and say what the scene requires",
    "placements": "plan sensors around a body, and say what a map from each would cost",
    "compare-meshes": "compare meshes of one video: joints, velocities along the line of sight,"
    " Doppler maps",
    "strip": "draw frames side by side: the video above its mesh",
    "simulate": "make radar samples of any mesh, or pairs of simulated people to train on",
    "train": "train a denoiser that turns synthetic Doppler into what a radar would show",
    "runs": "list training runs, and pause, stop or cancel one",
    "eval": "measure denoisers on people that they have not learnt from",
    "study": "find out whether synthetic data help a classifier on a real radar",
    "batch": "fit, synthesise, denoise and export many recordings from many places",
    "warm-up": "compile the numerical kernels: part of `sd2 doctor` now",
    "fetch-models": "fetch the landmark models that `sd2 fit` needs: part of `sd2 doctor` now",
}
"""Commands, and what each does in a line, in the order of the help."""

WINDOW_COMMANDS = ("open", "demo", "doctor")
"""Commands that are not the library's; whoever calls :func:`build_parser` adds them."""
