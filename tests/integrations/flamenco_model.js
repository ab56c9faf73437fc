// A small model of what Flamenco's Manager gives to a job compiler script, and of what it refuses.
//
//     node flamenco_model.js SCRIPT < job.json
//
// writes the job type's settings and the tasks, in an order in which they can run, as JSON.

const fs = require("fs");
const posix = require("path").posix;
const vm = require("vm");

const TASK_TYPES = ["blender", "ffmpeg", "file-management", "misc"];
const PARAMETERS = { exec: { exe: "string", args: "object" }, echo: { message: "string" } };
const TYPES = { string: "string", int32: "number", float: "number", bool: "boolean" };
const SUBTYPES = ["file_path", "dir_path", "file_name", "hashed_file_path"];

class Task {
    constructor(name, type) {
        if (typeof name !== "string" || !TASK_TYPES.includes(type)) throw new Error(`no task ${name} of type ${type}`);
        Object.assign(this, { name, type, commands: [], dependencies: [] });
    }
    addCommand(command) {
        if (!(command instanceof Command)) throw new Error("not a command");
        this.commands.push(command);
    }
    addDependency(task) {
        if (!(task instanceof Task)) throw new Error("not a task");
        this.dependencies.push(task);
    }
}

class Command {
    constructor(name, parameters) {
        const known = PARAMETERS[name];
        if (!known) throw new Error(`no command ${name}`);
        for (const key of Object.keys(known)) {
            if (typeof parameters[key] !== known[key]) throw new Error(`${name}: ${key} must be a ${known[key]}`);
        }
        if (name === "exec" && !parameters.args.every((word) => typeof word === "string")) throw new Error("args are texts");
        Object.assign(this, { name, parameters });
    }
}

// The Manager takes the job's settings, and the default of each that is left out.
function settled(described, given) {
    const settings = {};
    for (const each of described) {
        const value = given[each.key] === undefined ? each.default : given[each.key];
        if (!(each.type in TYPES) || (each.subtype && !SUBTYPES.includes(each.subtype))) throw new Error(`type of ${each.key}`);
        if (value === undefined && each.required) throw new Error(`${each.key} is required`);
        if (value !== undefined && typeof value !== TYPES[each.type]) throw new Error(`${each.key} is no ${each.type}`);
        if (each.choices && !each.choices.includes(value)) throw new Error(`${each.key} is none of ${each.choices}`);
        settings[each.key] = value;
    }
    return settings;
}

const tasks = [];
const context = vm.createContext({
    author: { Task: (name, type) => new Task(name, type), Command: (name, parameters) => new Command(name, parameters) },
    path: { join: posix.join, dirname: posix.dirname, basename: posix.basename, isAbsolute: posix.isAbsolute },
    print: () => {},
});
const script = fs.readFileSync(process.argv[2], "utf8");
const jobType = vm.runInContext(`${script}\nJOB_TYPE`, context);
const job = JSON.parse(fs.readFileSync(0, "utf8"));
job.settings = settled(jobType.settings, job.settings);
job.addTask = (task) => tasks.push(task);
vm.runInContext("compileJob", context)(job);

const ordered = [];
while (ordered.length < tasks.length) {
    const next = tasks.find((task) => !ordered.includes(task) && task.dependencies.every((one) => ordered.includes(one)));
    if (!next) throw new Error("a task depends on itself, or on one that was not added to the job");
    ordered.push(next);
}
const plain = (task) => ({ ...task, dependencies: task.dependencies.map((one) => one.name) });
console.log(JSON.stringify({ settings: jobType.settings, tasks: ordered.map(plain) }));
