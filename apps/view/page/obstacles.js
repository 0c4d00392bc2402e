// Obstacles: planes, balls and meshes, which may move; meshes may deform.
"use strict";

async function makeObstacle(facts, box, cell) {
    const group = new THREE.Group();
    if (facts.shape === "plane") {
        group.add(makeFloor(facts, box, cell));
        return group;
    }
    const material = new THREE.MeshPhongMaterial({color: obstacleColour, specular: 0x111111});
    let geometry;
    if (facts.shape === "ball") {
        geometry = new THREE.SphereBufferGeometry(facts.radius, 64, 40);
        geometry.translate(...facts.centre);
    } else {
        const faces = await unpack(facts.faces), x = await unpack(facts.positions);
        geometry = new THREE.BufferGeometry();
        geometry.setIndex(new THREE.BufferAttribute(faces, 1));
        geometry.setAttribute("position", new THREE.BufferAttribute(x, 3));
        geometry = geometry.toNonIndexed();
        geometry.computeVertexNormals();
        if (facts.frames) group.frames = {faces, times: facts.frames.times, positions: await unpack(facts.frames.positions)};
    }
    const mesh = new THREE.Mesh(geometry, material);
    mesh.castShadow = mesh.receiveShadow = true;
    group.add(mesh);
    return group;
}

/** Puts the vertices of a mesh that deforms where they are at a time: straight from frame to frame. */
function deform({children: [{geometry}], frames: {faces, times, positions}}, time) {
    let after = times.findIndex((one) => one > time);
    if (after < 0) after = times.length;
    const first = Math.max(after - 1, 0), last = Math.min(after, times.length - 1), size = positions.length / times.length;
    const share = first === last ? 0 : (time - times[first]) / (times[last] - times[first]);
    const {array} = geometry.attributes.position;
    faces.forEach((vertex, corner) => {
        for (let k = 0; k < 3; k++) {
            const from = positions[first * size + 3 * vertex + k], to = positions[last * size + 3 * vertex + k];
            array[3 * corner + k] = from + share * (to - from);
        }
    });
    geometry.attributes.position.needsUpdate = true;
    geometry.computeVertexNormals();
    geometry.boundingBox = geometry.boundingSphere = null;
}

class Obstacles {
    /** times: of the frames that the page shows. */
    static async of(facts, box, cell, times) {
        const groups = [];
        for (const obstacle of facts) groups.push(await makeObstacle(obstacle, box, cell));
        return new Obstacles(facts, groups, times);
    }

    constructor(facts, groups, times) { Object.assign(this, {facts, groups, times}); }

    /**
     * The box with the obstacles that move, wherever they are in any frame. One that would leave the bodies less than a
     * quarter of the picture is left out.
     */
    around(box) {
        const all = box.clone(), most = 4 * box.getSize(new THREE.Vector3()).length();
        this.facts.forEach(({shape, shifts}, i) => {
            if (shape === "plane" || !shifts.length) return;
            const geometry = this.groups[i].children[0].geometry, own = new THREE.Box3(), way = all.clone();
            geometry.computeBoundingBox();
            shifts.forEach((_, frame) => {
                own.copy(geometry.boundingBox).applyMatrix4(this.place(i, frame));
                way.union(own);
            });
            if (way.getSize(new THREE.Vector3()).length() <= most) all.copy(way);
        });
        return all;
    }

    /** Puts the floors around the bodies in another box. */
    fit(box, cell) {
        this.facts.forEach((facts, i) => {
            if (facts.shape !== "plane") return;
            this.groups[i].traverse(({geometry, material}) => {
                if (geometry) geometry.dispose();
                if (material) material.dispose();
            });
            this.groups[i].remove(...this.groups[i].children);
            this.groups[i].add(makeFloor(facts, box, cell));
        });
    }

    place(i, frame) {
        const {shifts, turns, scales} = this.facts[i], scale = scales[frame];
        return new THREE.Matrix4().compose(new THREE.Vector3(...shifts[frame]), new THREE.Quaternion(...turns[frame]),
                                           new THREE.Vector3(scale, scale, scale));
    }

    move(frame) {
        this.facts.forEach(({shifts}, i) => {
            const group = this.groups[i];
            if (shifts.length) this.place(i, frame).decompose(group.position, group.quaternion, group.scale);
            if (group.frames) deform(group, this.times[frame]);
        });
    }
}
