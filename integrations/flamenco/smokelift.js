// A Flamenco job type: one clip to a volume of smoke, checked, and rendered by Cycles if that is asked for.
//
// It goes into the folder `scripts` beside flamenco-manager. The Manager's configuration needs a variable `smokelift`, the
// command line as the workers see it; `blender` is there already.

const JOB_TYPE = {
    label: "Smokelift",
    description: "Turn a clip of smoke into an OpenVDB sequence of density and velocity",
    settings: [
        { key: "input", type: "string", subtype: "file_path", required: true,
          description: "Video, scene file (.toml) or frame_####.png, where the workers see it" },
        { key: "output", type: "string", subtype: "dir_path", required: true,
          description: "Directory for the sequence, where the workers see it" },
        { key: "quality", type: "string", choices: ["draft", "balanced", "fine", "final"], default: "balanced" },
        { key: "frames", type: "string", default: "",
          description: "First and last frame of the clip from 0, as 10:99; all of them if empty" },
        { key: "detail", type: "float", default: 1.0,
          description: "Fine structure in depth, made up in the texture of the clip: 0 (smooth) to 1" },
        { key: "seed", type: "int32", default: 0, description: "Which of the plausible smokes of the clip" },
        { key: "preview_script", type: "string", subtype: "file_path", default: "",
          description: "cycles_preview.py, where the workers see it; without it nothing is rendered" },
        { key: "preview_frames", type: "int32", default: 4, description: "Frames that Cycles renders, spread over the clip" },
        { key: "preview_samples", type: "int32", default: 64, description: "Samples of a pixel" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const reconstruct = reconstructTask(settings);
    const check = smokeliftTask("check", ["check", settings.output]);
    check.addDependency(reconstruct);
    job.addTask(reconstruct);
    job.addTask(check);
    if (settings.preview_script) {
        const preview = previewTask(settings);
        preview.addDependency(check);
        job.addTask(preview);
    }
}

// A task that is tried again, on this worker or another, goes on from the finished frames.
function reconstructTask(settings) {
    const options = ["--quality", settings.quality, "--detail", `${settings.detail}`, "--seed", `${settings.seed}`];
    const frames = settings.frames ? ["--frames", settings.frames] : [];
    const paths = [settings.input, "--out", settings.output];
    return smokeliftTask("reconstruct", ["reconstruct"].concat(paths, options, frames, ["--resume"]));
}

function smokeliftTask(name, args) {
    const task = author.Task(name, "misc");
    task.addCommand(author.Command("exec", { exe: "{smokelift}", args: args }));
    return task;
}

// Beside the sequence's directory, which is for the sequence alone.
function previewTask(settings) {
    const pictures = path.join(path.dirname(settings.output), `${path.basename(settings.output)}_preview`);
    const chosen = ["--frames", `${settings.preview_frames}`, "--samples", `${settings.preview_samples}`];
    const task = author.Task("preview", "blender");
    task.addCommand(author.Command("exec", {
        exe: "{blender}",
        args: ["--background", "--factory-startup", "--python-exit-code", "1", "--python", settings.preview_script,
               "--", settings.output, pictures].concat(chosen),
    }));
    return task;
}
