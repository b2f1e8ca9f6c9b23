"""The one table of actions: menus, keys, tips and the list of keys all come from it."""

from __future__ import annotations

from sd2app.classify.actions import CLASSIFIERS, FINDING
from sd2app.feature import (
    Action,
    has_content,
    has_mesh,
    has_spans,
    one_selected,
    some_selected,
)
from sd2app.labels.actions_files import COMPARING, LABEL_FILES, SUGGESTIONS
from sd2app.labels.actions_marking import MARKING, SPANS, TRACKS

MOUSE = (
    ("Click or drag in a heatmap or the ruler", "Go to that time; a click in a heatmap selects"),
    ("Wheel over a heatmap", "Zoom in on time, about the pointer"),
    ("Shift+wheel, middle drag", "Pan in time"),
    ("Double click in a heatmap", "Play the span there in a loop; none: the whole recording"),
    ("Drag an empty place of the labels", "Mark a span; with Shift also over others, cutting them"),
    ("Drag a span or an edge of it", "Move or shorten it; Alt: nothing attracts it"),
    ("Click a span, Ctrl+click, Shift+click", "Select it and go to its start, or several"),
    ("Drag an edge of a selected span in a heatmap", "Move that edge"),
    ("Double click a span", "Play it in a loop"),
    ("Drag the title of the radar's heatmap", "Align the capture in time"),
    ("Drag the frame or its edges in the overview", "Pan or zoom in time"),
    ("Drag the sensor in the scene", "Move it in the plane of the screen"),
    ("Click a planned place in the scene", "Put the sensor there"),
    ("Shift+drag, Ctrl+drag the sensor", "Move it vertically, or along the line to the body"),
    ("Drop a model file (.safetensors)", "Denoise this recording with it, or classify"),
    ("Drop a file of labels", "Import them"),
    ("Drag elsewhere, middle drag, wheel in the scene", "Turn, shift, zoom; double click resets"),
)
"""What the mouse does, for the list of keys."""

ACTIONS: tuple[Action, ...] = (
    Action(
        "new_from_video", "File", "New from video…", ("Ctrl+N",),
        "Fit a body to the person in a video and make a recording of both",
        lambda w: w.dialogs.new_from_video(),
        lambda c: not c.fit.busy,
    ),
    Action(
        "open", "File", "Open…", ("Ctrl+O",),
        "Open a video, mesh or radar capture, or several that belong together",
        lambda w: w.dialogs.open_files(),
    ),
    Action(
        "open_folder", "File", "Open folder…", ("Ctrl+Shift+O",),
        "Open a recording (.sd2), a radar capture or a folder of meshes",
        lambda w: w.dialogs.open_folder(),
    ),
    Action(
        "add", "File", "Add to this recording…", (),
        "Add a video, mesh or radar capture to what is open",
        lambda w: w.dialogs.add_files(), has_content,
    ),
    Action(
        "add_folder", "File", "Add folder to this recording…", (),
        "Add a radar capture or a folder of meshes to what is open",
        lambda w: w.dialogs.add_folder(), has_content,
    ),
    Action(
        "compare", "File", "Compare with mesh…", (),
        "Measure another mesh of this video against the one that is open",
        lambda w: w.compare_with_mesh(), has_mesh,
    ),
    Action(
        "relink", "File", "Find missing files…", (),
        "Choose one folder; all missing files are looked for below it",
        lambda w: w.dialogs.relink(),
        lambda c: c.document.recording is not None and bool(c.document.recording.missing()),
    ),
    Action(
        "save", "File", "Save", ("Ctrl+S",), "Save labels, sensor and alignment in the recording",
        lambda w: w.dialogs.save(), has_content, separator_before=True,
    ),
    Action(
        "save_as", "File", "Save as…", ("Ctrl+Shift+S",),
        "Make a recording folder that refers to these files",
        lambda w: w.dialogs.save_as(), has_content,
    ),
    Action(
        "export_map", "File", "Export synthetic map…", ("Ctrl+E",),
        "Write the synthetic Doppler map with its provenance (.npz)",
        lambda w: w.dialogs.export_map(),
        lambda c: c.synthesis.complete,
    ),
    Action(
        "export_denoised", "File", "Export denoised map…", (),
        "Write the denoised Doppler map with its provenance (.npz)",
        lambda w: w.dialogs.export_denoised(),
        lambda c: c.denoise.can_export,
    ),
    Action(
        "export_maps", "File", "Export figure of the maps…", (),
        "Write the Doppler maps one above the other, as they are shown (.png, .svg, .pdf)",
        lambda w: w.dialogs.export_maps(),
        lambda c: any(track.map is not None for track in c.tracks),
    ),
    Action(
        "export_strip", "File", "Export strip of frames…", ("Ctrl+Shift+E",),
        "Write frames side by side, the video above its mesh (.png, .svg, .pdf)",
        lambda w: w.dialogs.export_strip(),
        lambda c: c.document.video is not None or has_mesh(c),
    ),
    Action(
        "export_dataset", "File", "Export data set…", ("Ctrl+Shift+D",),
        "Write segments with labels to learn from (Zarr, HDF5, NPZ), of this recording or a folder",
        lambda w: w.dialogs.export_dataset(),
    ),
    Action(
        "batch", "File", "Batch…", ("Ctrl+B",),
        "Fit, synthesise, denoise and export many recordings from many places, beside the window",
        lambda w: w.batch_dialogs.show(), separator_before=True,
    ),
    Action(
        "recover_labels", "File", "Recover labels…", (),
        "Labels that were not saved when the program ended, or that were not wanted back then",
        lambda w: w.dialogs.recover_labels(), separator_before=True,
    ),
    Action(
        "quit", "File", "Quit", ("Ctrl+Q",), "Close the window", lambda w: w.close_window(),
        separator_before=True,
    ),
    Action(
        "undo", "Edit", "Undo", ("Ctrl+Z",), "Take back the last edit of this recording",
        lambda w: w.context.document.undo_stack.undo(),
        lambda c: c.document.undo_stack.canUndo() and not c.label_dragging.dragging,
    ),
    Action(
        "redo", "Edit", "Redo", ("Ctrl+Shift+Z",), "Do again what was taken back",
        lambda w: w.context.document.undo_stack.redo(),
        lambda c: c.document.undo_stack.canRedo() and not c.label_dragging.dragging,
    ),
    Action(
        "sensor_to_camera", "Edit", "Sensor at the camera", ("Home",),
        "Put the sensor at the camera, looking along its axis",
        lambda w: w.context.edits.sensor_to_camera(), separator_before=True,
    ),
    Action(
        "aim_sensor", "Edit", "Aim sensor at the body", ("A",),
        "Turn the sensor towards the body in this frame",
        lambda w: w.context.edits.aim_sensor(w.context.synthesis.torso_m),
        lambda c: c.synthesis.torso_m is not None,
    ),
    Action(
        "placements", "Edit", "Placements…", ("Shift+S",),
        "Plan a grid or a cloud of sensors around the body, for a map from each",
        lambda w: w.show_placements(),
    ),
    Action(
        "colour_velocity", "View", "Colour by radial velocity", ("Alt+1",),
        "Blue recedes, red approaches, grey is hidden or still",
        lambda w: w.context.display.set_mesh_colour("velocity"), has_mesh,
        lambda c: c.display.mesh_colour == "velocity",
    ),
    Action(
        "colour_range", "View", "Colour by range", ("Alt+2",), "Distance from the sensor in metres",
        lambda w: w.context.display.set_mesh_colour("range"), has_mesh,
        lambda c: c.display.mesh_colour == "range",
    ),
    Action(
        "colour_visibility", "View", "Colour by visibility", ("Alt+3",),
        "What the sensor sees, and what is hidden from it",
        lambda w: w.context.display.set_mesh_colour("visibility"), has_mesh,
        lambda c: c.display.mesh_colour == "visibility",
    ),
    Action(
        "colour_plain", "View", "Plain mesh", ("Alt+4",), "One colour",
        lambda w: w.context.display.set_mesh_colour("plain"), has_mesh,
        lambda c: c.display.mesh_colour == "plain",
    ),
    Action(
        "dots", "View", "Vertices as dots", ("D",), "Draw vertices instead of the surface",
        lambda w: w.context.display.set_as_dots(not w.context.display.as_dots), has_mesh,
        lambda c: c.display.as_dots,
    ),
    Action(
        "overlay", "View", "Mesh over the video", ("M",), "Draw the mesh over the video",
        lambda w: w.context.overlay.set_style(shown=not w.context.overlay.style.shown), has_mesh,
        lambda c: c.overlay.style.shown,
    ),
    Action(
        "overlay_dots", "View", "Mesh over the video as dots", ("Shift+M",),
        "Draw vertices over the video instead of the surface",
        lambda w: w.context.overlay.set_style(as_dots=not w.context.overlay.style.as_dots),
        has_mesh, lambda c: c.overlay.style.as_dots,
    ),
    Action(
        "draw_placements", "View", "Placements in the scene", (),
        "Draw the places that are planned for sensors",
        lambda w: w.context.placements.set_shown(not w.context.placements.shown),
        lambda c: c.placements.plan is not None,
        lambda c: c.placements.shown,
    ),
    Action(
        "view_three_quarter", "View", "Scene: overview", ("Ctrl+1",),
        "See sensor, camera and body",
        lambda w: w.set_scene_view("overview"), has_mesh, separator_before=True,
    ),
    Action(
        "view_camera", "View", "Scene: from the camera", ("Ctrl+2",), "See what the camera sees",
        lambda w: w.set_scene_view("camera"), has_mesh,
    ),
    Action(
        "view_sensor", "View", "Scene: from the sensor", ("Ctrl+3",), "See what the sensor sees",
        lambda w: w.set_scene_view("sensor"), has_mesh,
    ),
    Action(
        "view_side", "View", "Scene: from the side", ("Ctrl+4",), "See sensor and body sideways",
        lambda w: w.set_scene_view("side"), has_mesh,
    ),
    Action(
        "view_top", "View", "Scene: from above", ("Ctrl+5",), "See sensor and body from above",
        lambda w: w.set_scene_view("top"), has_mesh,
    ),
    Action(
        "zoom_in", "View", "Zoom in on time", ("+", "="), "Show less time, around the cursor",
        lambda w: w.context.span.zoom(0.7, w.context.playback.time_s), has_content,
        separator_before=True,
    ),
    Action(
        "zoom_out", "View", "Zoom out", ("-",), "Show more time",
        lambda w: w.context.span.zoom(1.0 / 0.7, w.context.playback.time_s), has_content,
    ),
    Action(
        "zoom_fit", "View", "Whole recording", ("0",), "Show all of it",
        lambda w: w.context.span.fit(), has_content,
    ),
    Action(
        "reset_reference", "View", "Set 0 dB to what is shown", ("R",),
        "Make the strongest bin of each map 0 dB",
        lambda w: w.context.reset_references(), has_content,
    ),
    Action(
        "uncertain", "View", "Show uncertain cells", ("U",),
        "Take the colour from cells of the synthetic map that are known to worse than half of"
        " their value; the pointer reads value ± deviation",
        lambda w: w.context.uncertainty.set_shown(not w.context.uncertainty.shown),
        lambda c: not c.uncertainty.why_not,
        lambda c: c.uncertainty.shown and not c.uncertainty.why_not,
        why_not=lambda c: c.uncertainty.why_not,
    ),
    Action(
        "show_sensor", "View", "Sensor panel", ("S",), "Where the sensor is and what it sees",
        lambda w: w.show_sensor(), separator_before=True,
    ),
    Action(
        "show_trade", "View", "Accuracy panel", ("T",),
        "How exact the synthetic map is to be, and what that costs",
        lambda w: w.side.bring_up("Accuracy"),
    ),
    Action(
        "show_train", "View", "Train panel", ("Shift+T",),
        "Train a denoiser beside the window, watch it, and use it",
        lambda w: w.show_training("denoisers"),
    ),
    Action(
        "show_labels", "View", "Labels panel", ("Shift+L",),
        "The spans as a table, statistics of them, and the label set",
        lambda w: w.show_labels(),
    ),
    Action(
        "show_agree", "View", "Agree panel", ("Shift+A",),
        "How far another person's labels agree with these",
        lambda w: w.side.bring_up("Agree"),
    ),
    Action(
        "measure", "View", "Measure this scene", ("Ctrl+M",),
        "Measure error and cost of every plan with the sensor where it is; takes a while",
        lambda w: w.measure_scene(),
        lambda c: c.trade.measured.can_measure,
    ),
    Action(
        "dark", "View", "Dark theme", ("Ctrl+D",), "Dark or light",
        lambda w: w.set_dark(not w.context.display.dark), checked=lambda c: c.display.dark,
        separator_before=True,
    ),
    Action(
        "play", "Play", "Play", ("Space",), "Play or pause",
        lambda w: w.context.playback.toggle(), has_content,
        lambda c: c.playback.playing, icon="play",
    ),
    Action(
        "previous_frame", "Play", "Previous frame", ("Left",), "One frame back",
        lambda w: w.context.playback.step_frames(-1), has_content, icon="previous",
    ),
    Action(
        "next_frame", "Play", "Next frame", ("Right",), "One frame on",
        lambda w: w.context.playback.step_frames(1), has_content, icon="next",
    ),
    Action(
        "back_second", "Play", "Back one second", ("Shift+Left",), "One second back",
        lambda w: w.context.playback.step_seconds(-1.0), has_content,
    ),
    Action(
        "on_second", "Play", "On one second", ("Shift+Right",), "One second on",
        lambda w: w.context.playback.step_seconds(1.0), has_content,
    ),
    Action(
        "first_frame", "Play", "First frame", ("Ctrl+Left",), "Go to the start",
        lambda w: w.context.playback.seek_frame(0), has_content, icon="first",
    ),
    Action(
        "last_frame", "Play", "Last frame", ("Ctrl+Right",), "Go to the end",
        lambda w: w.context.playback.seek_frame(len(w.context.playback.timebase) - 1),
        has_content, icon="last",
    ),
    Action(
        "slower", "Play", "Slower", (",",), "Play slower",
        lambda w: w.context.playback.change_speed(-1), separator_before=True, icon="slower",
    ),
    Action(
        "faster", "Play", "Faster", (".",), "Play faster",
        lambda w: w.context.playback.change_speed(1), icon="faster",
    ),
    Action(
        "loop", "Play", "Loop", ("L",), "Start again at the end",
        lambda w: w.context.playback.set_loop(not w.context.playback.loop),
        checked=lambda c: c.playback.loop, icon="loop",
    ),
    *MARKING,
    Action(
        "span_starts_here", "Labels", "Selected span starts here", ("[",),
        "The frame on screen is the first one of the selected span",
        lambda w: w.context.label_edits.edge_here("start"), one_selected,
        separator_before=True, edits_labels=True,
    ),
    Action(
        "span_ends_here", "Labels", "Selected span ends here", ("]",),
        "The frame on screen is the last one of the selected span",
        lambda w: w.context.label_edits.edge_here("end"), one_selected, edits_labels=True,
    ),
    Action(
        "nudge_back", "Labels", "Move selected spans one frame back", ("Alt+Left",),
        "They stop at their neighbours",
        lambda w: w.context.label_edits.nudge(-1), some_selected, edits_labels=True,
    ),
    Action(
        "nudge_on", "Labels", "Move selected spans one frame on", ("Alt+Right",),
        "They stop at their neighbours",
        lambda w: w.context.label_edits.nudge(1), some_selected, edits_labels=True,
    ),
    Action(
        "split_span", "Labels", "Split span here", ("/",),
        "Cut the span under the cursor in two, before the frame on screen",
        lambda w: w.context.label_edits.split(), has_spans, edits_labels=True,
    ),
    Action(
        "merge_spans", "Labels", "Merge selected spans", ("G",),
        "One span from the first start to the last end (Ctrl+click selects several)",
        lambda w: w.context.label_edits.merge(), lambda c: len(c.labels.selected) > 1,
        edits_labels=True,
    ),
    Action(
        "delete_spans", "Labels", "Delete selected spans", ("Backspace", "Del"),
        "Undo brings them back",
        lambda w: w.context.label_edits.delete(), some_selected,
        edits_labels=True,
    ),
    *SPANS,
    Action(
        "next_span", "Labels", "Next span", ("N",), "Select it and go to its start",
        lambda w: w.context.label_edits.step(1), has_spans, separator_before=True,
    ),
    Action(
        "previous_span", "Labels", "Previous span", ("P",), "Select it and go to its start",
        lambda w: w.context.label_edits.step(-1), has_spans,
    ),
    *TRACKS,
    *SUGGESTIONS,
    *FINDING,
    *LABEL_FILES,
    Action(
        "restore_labels", "Labels", "Restore labels that were not saved", (),
        "Take over what an earlier session left behind; one undo takes that back",
        lambda w: w.context.label_edits.restore(),
        lambda c: c.label_session.offer is not None, separator_before=True, edits_labels=True,
    ),
    Action(
        "edit_labels_here", "Labels", "Try again to edit labels here", (),
        "Where another window edited them: take them over, once it is closed",
        lambda w: w.context.label_session.try_again(), lambda c: c.label_session.read_only,
    ),
    Action(
        "find_spans", "Labels", "Find spans…", ("Ctrl+F",),
        "Search the table of spans for a label, a note or a track",
        lambda w: w.show_labels("search"), has_content,
    ),
    Action(
        "label_set", "Labels", "Label set…", ("Ctrl+L",),
        "Names, keys, colours and classes of the labels, to be edited and shared",
        lambda w: w.show_labels("label set"),
    ),
    *COMPARING,
    Action(
        "open_model", "Model", "Open model file…", (),
        "Denoise this recording with a model of your own (.safetensors)",
        lambda w: w.dialogs.open_model(), has_content, separator_before=True,
    ),
    Action(
        "model_card", "Model", "About this model…", (),
        "What it learned from, what was measured of it, and its limits",
        lambda w: w.dialogs.show_model_card(),
        lambda c: c.denoise.card is not None,
    ),
    Action(
        "difference", "Model", "Difference to the radar", ("X",),
        "Show denoised minus real, in signed colours, below the maps",
        lambda w: w.context.difference.set_wanted(not w.context.difference.wanted),
        lambda c: not c.difference.why_not,
        lambda c: c.difference.shown,
        separator_before=True,
        why_not=lambda c: c.difference.why_not,
    ),
    Action(
        "compare_models", "Model", "Compare with the model before", ("B",),
        "Show the map of the model that was in use before below that of this one",
        lambda w: w.context.denoise.set_comparing(not w.context.denoise.comparing),
        lambda c: c.denoise.before is not None,
        lambda c: c.denoise.comparing,
        why_not=lambda c: (
            "" if c.denoise.before is not None else "No other model has been in use here yet"
        ),
    ),
    Action(
        "live", "Model", "Denoise live while playing", ("V",),
        "Frame by frame as the clock reaches them, knowing the past only, as beside a radar",
        lambda w: w.context.live.set_wanted(not w.context.live.wanted),
        checked=lambda c: c.live.wanted,
    ),
    *CLASSIFIERS,
    Action(
        "sample", "Help", "Open the sample recording", (), "A simulated person, four gestures",
        lambda w: w.open_sample(),
    ),
    Action(
        "keys", "Help", "Keys…", ("?", "F1"), "All keys, to be found and changed",
        lambda w: w.dialogs.show_keys(),
    ),
    Action("about", "Help", "About SD² Studio", (), "Version and licence",
           lambda w: w.dialogs.show_about()),
)  # fmt: skip
