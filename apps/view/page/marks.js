// Marked faces of a body. Those that something hides shine through.
"use strict";

class Marks {
    /** facts: of the frames so far; null: none of them has marked faces. */
    static async of(facts, body, kind, frames) {
        const marks = new Marks(body, kind);
        await marks.append(facts, frames);
        return marks;
    }

    constructor(body, kind) {
        Object.assign(this, {body, frames: []});
        this.geometry = new THREE.BufferGeometry();
        this.geometry.setAttribute("position", body.geometry.attributes.position);
        this.geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(0), 1));
        const order = {near: 1, intersecting: 2, missed: 3}[kind];
        const mesh = (settings) => {
            const made = new THREE.Mesh(this.geometry, new THREE.MeshBasicMaterial(
                {color: markColours[kind], side: THREE.DoubleSide, transparent: true, depthWrite: false, ...settings}));
            made.frustumCulled = false;
            made.renderOrder = 10 + order;
            return made;
        };
        this.group = new THREE.Group();
        this.group.add(mesh({opacity: 0.92, polygonOffset: true, polygonOffsetFactor: -order, polygonOffsetUnits: -order}),
            mesh({opacity: kind === "near" ? 0.16 : 0.34, depthTest: false}));
        this.group.visible = false;
    }

    async append(facts, frames) {
        const counts = facts ? await unpack(facts.counts) : new Uint32Array(frames);
        const faces = facts ? await unpack(facts.faces) : new Uint32Array(0);
        let begin = 0;
        for (const count of counts) this.frames.push(faces.subarray(begin, begin += count));
        const most = counts.reduce((a, b) => Math.max(a, b), 0);
        if (3 * most > this.geometry.index.count)
            this.geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(3 * most), 1));
    }

    at(frame) { return this.frames[frame]; }

    show(frame, isVisible) {
        const marked = this.at(frame), index = this.geometry.index, {drawn} = this.body;
        this.group.visible = isVisible && marked.length > 0;
        if (!this.group.visible) return;
        for (let i = 0; i < marked.length; ++i)
            for (let c = 0; c < 3; ++c) index.array[3 * i + c] = drawn[3 * marked[i] + c];
        index.needsUpdate = true;
        this.geometry.setDrawRange(0, 3 * marked.length);
    }
}
