// Rigid obstacles: planes, balls and meshes, which may move.
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
    }
    const mesh = new THREE.Mesh(geometry, material);
    mesh.castShadow = mesh.receiveShadow = true;
    group.add(mesh);
    return group;
}

class Obstacles {
    static async of(facts, box, cell) {
        const groups = [];
        for (const obstacle of facts) groups.push(await makeObstacle(obstacle, box, cell));
        return new Obstacles(facts, groups);
    }

    constructor(facts, groups) { Object.assign(this, {facts, groups}); }

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
        });
    }
}
