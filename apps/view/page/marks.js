// Marked faces of a body. Those that something hides shine through.
"use strict";

class Marks {
    static async of(facts, body, kind) {
        if (!facts) return null;
        return new Marks(await unpack(facts.counts), await unpack(facts.faces), body, kind);
    }

    constructor(counts, faces, body, kind) {
        Object.assign(this, {faces, body, begin: new Uint32Array(counts.length + 1)});
        counts.forEach((count, f) => { this.begin[f + 1] = this.begin[f] + count; });
        const most = counts.reduce((a, b) => Math.max(a, b), 0);
        this.geometry = new THREE.BufferGeometry();
        this.geometry.setAttribute("position", body.geometry.attributes.position);
        this.geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(3 * most), 1));
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

    at(frame) { return this.faces.subarray(this.begin[frame], this.begin[frame + 1]); }

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
