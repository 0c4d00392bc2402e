// Puts the page together.
"use strict";

const markKinds = ["near", "intersecting", "missed"];

/** End of the scale of a scalar in the current frame, and the largest number where the scale holds. */
function scaleOf(scalar, numbers, scale) {
    if (scale === "usual") return {high: scalar.usual || scalar.max, largest: scalar.max};
    if (scale === "largest") return {high: scalar.max, largest: scalar.max};
    let high = 0;
    for (const list of numbers)
        if (list) for (const number of list) high = Math.max(high, number);
    return {high, largest: high};
}

function paint(bodies, facts, panel, legend) {
    const scalar = facts.scalars.find(({name}) => name === panel.colour);
    if (!scalar) {
        legend.hide();
        for (const body of bodies) body.showColour();
        return;
    }
    const numbers = bodies.map((body) => body.scalar(scalar.name));
    const {high: needed, largest} = scaleOf(scalar, numbers, panel.scale), high = roundEnd(needed);
    bodies.forEach((body, i) => (numbers[i] ? body.showScalar(numbers[i], high) : body.showColour()));
    const from = scalar.name === "displacement" ? ` from ${facts.displacementFrom}` : "";
    legend.show(scalar.name[0].toUpperCase() + scalar.name.slice(1) + from, scalar.unit, high, largest);
}

function describe(facts, bodies, cell, hasFloor) {
    const faces = bodies.reduce((sum, body) => sum + body.faces.length / 3, 0).toLocaleString("en");
    const {length} = facts.times, of = length < facts.recordedFrames && length > 1 ? ` of ${facts.recordedFrames}` : "";
    byId("title").querySelector("h1").textContent = facts.title;
    byId("summary").textContent = [
        bodies.length === 1 ? "1 body" : `${bodies.length} bodies`, `${faces} faces`,
        facts.live ? "" : length === 1 ? "1 pose" : `${length}${of} frames`,
        hasFloor ? `grid ${Number(cell.toPrecision(1))} m` : ""].filter(Boolean).join(" · ");
    byId("program").textContent = facts.program;
}

/** Adds a frame of a run that goes on. */
async function append(frame, facts, bodies, bounds, marks, arrows) {
    if (arrows) await arrows.append(frame.reactions);
    for (const [i, ofBody] of frame.bodies.entries()) {
        await bodies[i].append(ofBody);
        if (bounds[i]) await bounds[i].append(ofBody.bounds);
        for (const entry of marks)
            if (entry.i === i) await entry.marks.append(ofBody.marks[entry.kind], frame.times.length);
    }
    addFacts(facts, frame);
}

async function start() {
    const facts = JSON.parse(byId("facts").textContent), bodies = [];
    for (const [i, body] of facts.bodies.entries()) bodies.push(await Body.of(body, i));
    const up = new THREE.Vector3(...facts.up), cellIn = (box) => roundLength(box.getSize(new THREE.Vector3()).length() / 12);
    let box = boxOf(bodies);
    const obstacles = await Obstacles.of(facts.obstacles, box, cellIn(box), facts.times);
    box = obstacles.around(box);
    obstacles.fit(box, cellIn(box));
    const summarise = () => describe(facts, bodies, cellIn(box), facts.obstacles.some(({shape}) => shape === "plane"));
    document.title = facts.title;
    summarise();

    const bounds = [], marks = [];
    for (const [i, {bounds: ofTree, marks: marked}] of facts.bodies.entries()) {
        bounds.push(ofTree ? await Bounds.of(ofTree, bodies[i].colour) : null);
        for (const kind of markKinds)
            if (facts.live || marked[kind])
                marks.push({i, kind, marks: await Marks.of(marked[kind], bodies[i], kind, facts.times.length)});
    }

    const arrows = facts.reactions ? await Arrows.of(facts.reactions) : null;
    const legend = new Legend(byId("legend"));
    let motion = null, view = null;
    const refresh = () => {
        const frame = motion ? motion.frame : 0;
        bodies.forEach((body, i) => {
            body.mesh.visible = panel.body(i);
            if (bounds[i]) bounds[i].show(frame, panel.depth, panel.body(i));
        });
        for (const {i, kind, marks: faces} of marks) faces.show(frame, panel.marks(kind) && panel.body(i));
        if (arrows) {
            const reach = roundLength(box.getSize(new THREE.Vector3()).length() / 5);
            tellArrows(byId("arrow-legend"), arrows.show(frame, panel.arrows, reach, panel.scale, (body) => panel.body(body)), reach);
        }
        paint(bodies, facts, panel, legend);
        panel.tell(frame);
        if (view) view.change();
    };
    let seenThrough = 0;
    const panel = new Panel(facts, bodies, bounds, () => {
        if (panel.seeThrough !== seenThrough) for (const body of bodies) body.seeThrough(panel.seeThrough);
        seenThrough = panel.seeThrough;
        refresh();
    });

    const light = new Light(box, up);
    view = new View(byId("canvas"), box, up);
    if (arrows) view.scene.add(arrows.group);
    view.scene.add(light.group, ...obstacles.groups, ...bodies.map(({mesh}) => mesh),
        ...bounds.filter(Boolean).map(({lines}) => lines), ...marks.map((entry) => entry.marks.group));
    const slider = byId("frame"), numberOf = (frame) => facts.numbers[frame];
    const tellCount = () => {
        const {frame} = motion, last = facts.times.length - 1, time = `${facts.times[frame].toFixed(3)} s`;
        slider.max = last;
        slider.value = frame;
        byId("transport").hidden = last === 0;
        byId("time").textContent = time;
        byId("count").textContent = `${numberOf(frame)} / ${numberOf(last)}`;
        slider.setAttribute("aria-valuetext", `frame ${numberOf(frame)} of ${numberOf(last)}, ${time}`);
    };
    const length = facts.live ? facts.live.seconds : facts.times[facts.times.length - 1] - facts.times[0];
    motion = new Motion(facts.times, length, (frame) => {
        for (const body of bodies) body.move(frame);
        obstacles.move(frame);
        refresh();
        tellCount();
    }, () => {
        byId("play").setAttribute("aria-label", motion.isPlaying ? "Pause" : "Play");
        byId("play").classList.toggle("is-playing", motion.isPlaying);
    });
    slider.addEventListener("input", () => { motion.pause(); motion.seek(Number(slider.value)); });
    byId("play").addEventListener("click", () => motion.toggle());
    byId("back").addEventListener("click", () => motion.step(-1));
    byId("on").addEventListener("click", () => motion.step(1));
    for (const speed of speeds) byId("speed").add(new Option(`${speed}×`, speed, false, speed === motion.speed));
    byId("speed").addEventListener("input", () => { motion.speed = Number(byId("speed").value); });

    const help = byId("help"), fit = () => view.lookAt(box);
    listen(keysOf({motion, view, panel, help, fit}), help);
    byId("open-help").addEventListener("click", () => help.showModal());
    byId("close-help").addEventListener("click", () => help.close());
    motion.seek(0);
    view.resize();
    fit();
    byId("status").hidden = true;

    // Bodies and obstacles that leave the box get a larger one, and the camera follows unless the reader has moved it.
    const fitAll = () => {
        const seen = obstacles.around(boxOf(bodies));
        if (box.containsBox(seen)) return;
        box = seen.union(box);
        box.expandByScalar(0.1 * box.getSize(new THREE.Vector3()).length());
        obstacles.fit(box, cellIn(box));
        light.fit(box);
        if (!view.isHeld) fit();
    };
    const take = async (frames) => {
        const newest = facts.times.length - 1;
        for (const frame of frames) await append(frame, facts, bodies, bounds, marks, arrows);
        fitAll();
        summarise();
        // Whoever looked at the newest frame goes on doing so.
        if (motion.frame === newest && !motion.isPlaying) motion.seek(Infinity);
        else tellCount();
    };
    const live = facts.live && new Live(facts.live.run, facts.times.length, take, (state, message) => {
        motion.grows = state === "running";
        tellLive(facts, state, message);
    });
    if (live) {
        live.tell("running", "");
        live.ended = live.follow().catch((error) => {
            live.tell("failed", `this page cannot show the next frames: ${error.message || error}`);
            throw error;
        });
    }
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    // For tests and for the console.
    Object.assign(window.nbdtree, {
        facts, view, live, seek: (frame) => motion.seek(frame), frame: () => motion.frame, play: () => motion.play(),
        pause: () => motion.pause(), isPlaying: () => motion.isPlaying, nodes: (body) => bodies[body].nodesNow,
        positions: (body) => bodies[body].x, scalar: (body, name) => bodies[body].scalar(name),
        choose: (id, value) => panel.choose(id, value),
        reactions: () => (arrows ? arrows.frames[motion.frame].map(({body, point, force, torque}) => ({
            body, point: point.toArray(), force: force.toArray(), torque: torque.toArray()})) : null),
        marked: (body, kind) => {
            const found = marks.find((entry) => entry.i === body && entry.kind === kind);
            return found ? Array.from(found.marks.at(motion.frame)) : [];
        },
        shownSeconds: performance.now() / 1000,
    });
}

window.nbdtree = {};
window.nbdtree.ready = start().catch((error) => {
    byId("status").hidden = false;
    byId("status").textContent = `This page cannot be shown here: ${error.message || error}`;
    throw error;
});
