// What holds and presses the bodies: forces as arrows, torques as arrows with two heads. They shine through what hides them.
"use strict";

const arrowKinds = [{name: "force", unit: "N", colour: "#b91c1c", heads: 1}, {name: "torque", unit: "N m", colour: "#6d28d9", heads: 2}];
const arrowSides = 8, longestArrow = 2;  // times the end of the scale; longer ones are cut

/** Adds the triangles of a cone between two rings about a line; a radius may be zero. */
function putCone(out, from, to, fromRadius, toRadius, u, v) {
    const at = (centre, radius, side) => {
        const angle = 2 * Math.PI * side / arrowSides;
        return centre.clone().addScaledVector(u, radius * Math.cos(angle)).addScaledVector(v, radius * Math.sin(angle));
    };
    for (let side = 0; side < arrowSides; ++side) {
        const a = at(from, fromRadius, side), b = at(from, fromRadius, side + 1);
        const c = at(to, toRadius, side + 1), d = at(to, toRadius, side);
        for (const p of [a, b, c, a, c, d]) out.push(p.x, p.y, p.z);
    }
}

/** Adds an arrow from a point on, with a width in the same unit as the way. */
function putArrow(out, point, way, width, heads) {
    const length = way.length(), along = way.clone().divideScalar(length);
    const side = Math.abs(along.z) < 0.9 ? new THREE.Vector3(0, 0, 1) : new THREE.Vector3(1, 0, 0);
    const u = side.cross(along).normalize(), v = along.clone().cross(u);
    const head = Math.min(5 * width, 0.8 * length / heads), radius = Math.min(2.2 * width, 0.45 * head);
    const on = (share) => point.clone().addScaledVector(along, share);
    const shaft = Math.min(width, 0.5 * radius);
    putCone(out, point, point, 0, shaft, u, v);
    putCone(out, point, on(length - head), shaft, shaft, u, v);
    for (let k = 0; k < heads; ++k) {
        const base = on(length - (k + 1) * head);
        putCone(out, base, base, 0, radius, u, v);
        putCone(out, base, on(length - k * head), radius, 0, u, v);
    }
}

class Arrows {
    /** facts: of the frames so far. */
    static async of(facts) {
        const arrows = new Arrows();
        await arrows.append(facts);
        return arrows;
    }

    constructor() {
        Object.assign(this, {frames: [], sizes: {force: [], torque: []}, group: new THREE.Group()});
        for (const kind of arrowKinds) {
            const mesh = new THREE.Mesh(new THREE.BufferGeometry(),
                new THREE.MeshBasicMaterial({color: kind.colour, depthTest: false, transparent: true, opacity: 0.9}));
            mesh.frustumCulled = false;
            mesh.renderOrder = 20;
            this.group.add(mesh);
        }
        this.group.visible = false;
    }

    async append(facts) {
        const counts = await unpack(facts.counts), bodies = await unpack(facts.bodies), numbers = await unpack(facts.numbers);
        let next = 0;
        for (const count of counts) {
            const frame = [];
            for (const end = next + count; next < end; ++next) {
                const vector = (part) => new THREE.Vector3(...numbers.subarray(9 * next + 3 * part, 9 * next + 3 * part + 3));
                const arrow = {body: bodies[next], point: vector(0), force: vector(1), torque: vector(2)};
                for (const {name} of arrowKinds) if (arrow[name].length() > 0) this.sizes[name].push(arrow[name].length());
                frame.push(arrow);
            }
            this.frames.push(frame);
        }
        for (const {name} of arrowKinds) this.sizes[name].sort((a, b) => a - b);
    }

    /** End of the scale and the largest size, of what the scale holds for. */
    range(name, frame, scale) {
        const all = scale === "frame" ? this.frames[frame].map((arrow) => arrow[name].length()).sort((a, b) => a - b) : this.sizes[name];
        if (all.length === 0) return {high: 0, largest: 0};
        const largest = all[all.length - 1];
        return {high: roundEnd(scale === "usual" ? all[all.length - 1 - Math.floor(all.length / 200)] : largest), largest};
    }

    /** Shows a frame. reach: how long an arrow at the end of the scale is. isShown(body): whether the arrows on a body are. Returns
     * what a legend says: for each kind its range. */
    show(frame, isVisible, reach, scale, isShown) {
        this.group.visible = isVisible;
        if (!isVisible) return [];
        return arrowKinds.map((kind, i) => {
            const {high, largest} = this.range(kind.name, frame, scale), out = [];
            for (const arrow of this.frames[frame]) {
                const size = arrow[kind.name].length();
                if (!(size > 0.01 * high) || !isShown(arrow.body)) continue;
                const length = reach * Math.min(size / high, longestArrow);
                putArrow(out, arrow.point, arrow[kind.name].clone().multiplyScalar(length / size), 0.03 * reach, kind.heads);
            }
            this.group.children[i].geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(out), 3));
            return {...kind, high, largest};
        });
    }
}

/** Says how long arrows are. ranges: as show() returns them; empty: nothing is shown. */
function tellArrows(element, ranges, reach) {
    element.hidden = ranges.length === 0;
    const rows = ranges.filter(({high}) => high > 0).map(({name, unit, colour, heads, high, largest}) => {
        const {unit: shown, factor} = prefixed(high, unit), length = prefixed(reach, "m");
        const row = document.createElement("div");
        row.className = "arrow-row";
        row.innerHTML = `<svg viewBox="0 0 48 12" aria-hidden="true"><path d="M0 5h${heads > 1 ? 24 : 36}v2H0z"/><path d="M36 0l12 6-12 6z"/>${heads > 1 ? '<path d="M24 0l12 6-12 6z"/>' : ""}</svg><span></span>`;
        row.querySelector("svg").style.fill = colour;
        const cut = largest > longestArrow * high * 1.001 ? `; cut at twice that, largest ${threeDigits(largest * factor)} ${shown}` : "";
        row.querySelector("span").textContent = `${name}: ${Number((high * factor).toPrecision(3))} ${shown} as long as ` +
            `${Number((reach * length.factor).toPrecision(3))} ${length.unit}${cut}`;
        return row;
    });
    if (rows.length === 0) rows.push(Object.assign(document.createElement("div"), {textContent: "none in this frame"}));
    element.querySelector(".arrow-rows").replaceChildren(...rows);
}
