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
    document.title = facts.title;
    byId("title").querySelector("h1").textContent = facts.title;
    byId("summary").textContent = [
        bodies.length === 1 ? "1 body" : `${bodies.length} bodies`, `${faces} faces`,
        length === 1 ? "1 pose" : `${length}${of} frames`,
        hasFloor ? `grid ${Number(cell.toPrecision(1))} m` : ""].filter(Boolean).join(" · ");
    byId("program").textContent = facts.program;
}

async function start() {
    const facts = JSON.parse(byId("facts").textContent), bodies = [];
    for (const [i, body] of facts.bodies.entries()) bodies.push(await Body.of(body, i));
    const box = boxOf(bodies), up = new THREE.Vector3(...facts.up);
    const size = box.getSize(new THREE.Vector3()).length(), cell = roundLength(size / 12);
    const obstacles = await Obstacles.of(facts.obstacles, box, cell);
    describe(facts, bodies, cell, facts.obstacles.some(({shape}) => shape === "plane"));

    const bounds = [], marks = [];
    for (const [i, {bounds: ofTree, marks: marked}] of facts.bodies.entries()) {
        bounds.push(ofTree ? await Bounds.of(ofTree, bodies[i].colour) : null);
        for (const kind of markKinds) marks.push({i, kind, marks: await Marks.of(marked[kind], bodies[i], kind)});
    }
    const shownMarks = marks.filter((entry) => entry.marks);

    const legend = new Legend(byId("legend"));
    let motion = null, view = null;
    const refresh = () => {
        const frame = motion ? motion.frame : 0;
        bodies.forEach((body, i) => {
            body.mesh.visible = panel.body(i);
            if (bounds[i]) bounds[i].show(frame, panel.depth, panel.body(i));
        });
        for (const {i, kind, marks: faces} of shownMarks) faces.show(frame, panel.marks(kind) && panel.body(i));
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

    view = new View(byId("canvas"), box, up);
    view.scene.add(makeLight(box, up), ...obstacles.groups, ...bodies.map(({mesh}) => mesh),
        ...bounds.filter(Boolean).map(({lines}) => lines), ...shownMarks.map((entry) => entry.marks.group));
    const slider = byId("frame"), last = facts.times.length - 1;
    slider.max = last;
    byId("transport").hidden = last === 0;
    motion = new Motion(facts.times, (frame) => {
        for (const body of bodies) body.move(frame);
        obstacles.move(frame);
        refresh();
        slider.value = frame;
        const time = `${facts.times[frame].toFixed(3)} s`;
        byId("time").textContent = time;
        byId("count").textContent = `${facts.numbers[frame]} / ${facts.numbers[last]}`;
        slider.setAttribute("aria-valuetext", `frame ${facts.numbers[frame]} of ${facts.numbers[last]}, ${time}`);
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
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    // For tests and for the console.
    Object.assign(window.nbdtree, {
        facts, view, seek: (frame) => motion.seek(frame), frame: () => motion.frame, play: () => motion.play(),
        pause: () => motion.pause(), isPlaying: () => motion.isPlaying, nodes: (body) => bodies[body].nodesNow,
        positions: (body) => bodies[body].x, scalar: (body, name) => bodies[body].scalar(name),
        choose: (id, value) => panel.choose(id, value),
        marked: (body, kind) => {
            const found = shownMarks.find((entry) => entry.i === body && entry.kind === kind);
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
