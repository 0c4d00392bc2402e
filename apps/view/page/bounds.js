// The bounds of a body's tree at one depth, as lines: boxes, or three circles for each sphere.
"use strict";

const boxEdges = [0, 1, 1, 3, 3, 2, 2, 0, 4, 5, 5, 7, 7, 6, 6, 4, 0, 4, 1, 5, 2, 6, 3, 7];
const circleSteps = 40;

function putBox(numbers, at, out, to) {
    for (const corner of boxEdges)
        for (let c = 0; c < 3; ++c) out[to++] = numbers[at + c + (corner >> c & 1 ? 3 : 0)];
    return to;
}

function putSphere(numbers, at, out, to) {
    for (let axis = 0; axis < 3; ++axis)
        for (let i = 0; i < circleSteps; ++i)
            for (const step of [i, i + 1]) {
                const angle = 2 * Math.PI * step / circleSteps, radius = numbers[at + 3];
                const point = [numbers[at], numbers[at + 1], numbers[at + 2]];
                point[(axis + 1) % 3] += radius * Math.cos(angle);
                point[(axis + 2) % 3] += radius * Math.sin(angle);
                out[to++] = point[0];
                out[to++] = point[1];
                out[to++] = point[2];
            }
    return to;
}

class Bounds {
    static async of(facts, colour) { return new Bounds(facts, await Quantised.of(facts), colour); }

    constructor({kind, boxes, firstNode}, numbers, colour) {
        Object.assign(this, {kind, boxes, firstNode, numbers, depth: -1});
        this.row = new Float32Array(numbers.row);
        this.geometry = new THREE.BufferGeometry();
        const dark = new THREE.Color(colour).lerp(new THREE.Color("#0f172a"), 0.45);
        this.lines = new THREE.LineSegments(this.geometry, new THREE.LineBasicMaterial({color: dark, transparent: true, opacity: 0.75}));
        this.lines.frustumCulled = false;
        this.lines.visible = false;
    }

    append(facts) { return this.numbers.append(facts); }

    get depths() { return this.firstNode.length - 1; }

    /** Shows a frame at a depth; at depth -1 nothing. A tree that is not so deep shows its deepest nodes. */
    show(frame, depth, isVisible) {
        this.lines.visible = depth >= 0 && isVisible;
        if (!this.lines.visible) return;
        const shown = Math.min(depth, this.depths - 1);
        this.numbers.read(frame, this.row);
        const size = this.boxes ? 6 : 4, begin = this.firstNode[shown], end = this.firstNode[shown + 1];
        const length = (end - begin) * (this.boxes ? 3 * boxEdges.length : 18 * circleSteps);
        let position = this.geometry.attributes.position;
        if (!position || position.array.length !== length) {
            position = new THREE.BufferAttribute(new Float32Array(length), 3);
            this.geometry.setAttribute("position", position);
        }
        const put = this.boxes ? putBox : putSphere;
        for (let node = begin, to = 0; node < end; ++node) to = put(this.row, size * node, position.array, to);
        position.needsUpdate = true;
    }
}
