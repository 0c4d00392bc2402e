// A body: its nodes and its surface in every frame, and how it is drawn.
"use strict";

class Body {
    static async of(facts, index) {
        const arrays = {faces: await unpack(facts.faces), nodes: await Quantised.of(facts.nodes)};
        if (facts.start) arrays.start = await unpack(facts.start);
        if (facts.embedding)
            for (const part of ["counts", "columns", "weights"]) arrays[part] = await unpack(facts.embedding[part]);
        arrays.scalars = {};
        for (const scalar of facts.scalars) arrays.scalars[scalar.name] = await Quantised.of(scalar);
        return new Body(facts, arrays, bodyColours[index % bodyColours.length]);
    }

    constructor(facts, arrays, colour) {
        Object.assign(this, arrays, {name: facts.name, colour, nodeCount: facts.nodeCount});
        this.vertexCount = this.counts ? this.counts.length : this.nodeCount;
        this.nodesNow = new Float32Array(3 * this.nodeCount);
        this.x = new Float32Array(3 * this.vertexCount);
        this.atStart = this.start && this.interpolate(this.start, new Float32Array(this.x.length), 3);
        this.move(0);
        this.makeMesh();
        this.move(0);
    }

    /** Adds a frame. */
    async append(facts) {
        await this.nodes.append(facts.nodes);
        for (const scalar of facts.scalars) await this.scalars[scalar.name].append(scalar);
    }

    /** Numbers at the surface's vertices from those at the nodes; `size` numbers each. */
    interpolate(ofNodes, out, size) {
        const {counts, columns, weights} = this;
        if (!counts) return out.set(ofNodes), out;
        for (let v = 0, k = 0; v < counts.length; ++v) {
            for (let c = 0; c < size; ++c) out[size * v + c] = 0;
            for (const end = k + counts[v]; k < end; ++k)
                for (let c = 0; c < size; ++c) out[size * v + c] += weights[k] * ofNodes[size * columns[k] + c];
        }
        return out;
    }

    makeMesh() {
        const {drawn, vertexOf} = splitAtCreases(this.faces, this.atStart || this.x);
        Object.assign(this, {drawn, vertexOf});
        this.geometry = new THREE.BufferGeometry();
        for (const name of ["position", "normal", "color"]) {
            const attribute = new THREE.BufferAttribute(new Float32Array(3 * vertexOf.length), 3);
            attribute.usage = THREE.DynamicDrawUsage;
            this.geometry.setAttribute(name, attribute);
        }
        this.geometry.setIndex(new THREE.BufferAttribute(drawn, 1));
        this.material = new THREE.MeshPhongMaterial({
            vertexColors: THREE.VertexColors, specular: 0x1c1c1c, shininess: 28, side: THREE.DoubleSide,
            polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
        });
        this.mesh = new THREE.Mesh(this.geometry, this.material);
        this.mesh.castShadow = this.mesh.receiveShadow = true;
        this.mesh.frustumCulled = false;
        this.showColour();
    }

    /** Puts the body into the pose of a frame. */
    move(frame) {
        this.frame = frame;
        this.interpolate(this.nodes.read(frame, this.nodesNow), this.x, 3);
        if (!this.geometry) return;
        this.placeVertices();
        this.turnNormals();
    }

    placeVertices() {
        const {x, vertexOf} = this, position = this.geometry.attributes.position;
        for (let i = 0; i < vertexOf.length; ++i)
            for (let c = 0; c < 3; ++c) position.array[3 * i + c] = x[3 * vertexOf[i] + c];
        position.needsUpdate = true;
    }

    /** Sums of the normals of the faces around each drawn vertex, by area; the shader makes them unit. */
    turnNormals() {
        const {drawn} = this, {position, normal} = this.geometry.attributes, x = position.array, n = normal.array;
        n.fill(0);
        for (let i = 0; i < drawn.length; i += 3) {
            const a = 3 * drawn[i], b = 3 * drawn[i + 1], c = 3 * drawn[i + 2];
            const ux = x[b] - x[a], uy = x[b + 1] - x[a + 1], uz = x[b + 2] - x[a + 2];
            const vx = x[c] - x[a], vy = x[c + 1] - x[a + 1], vz = x[c + 2] - x[a + 2];
            const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
            n[a] += nx; n[a + 1] += ny; n[a + 2] += nz;
            n[b] += nx; n[b + 1] += ny; n[b + 2] += nz;
            n[c] += nx; n[c + 1] += ny; n[c + 2] += nz;
        }
        for (let i = 0; i < n.length; i += 3) {
            const length = Math.hypot(n[i], n[i + 1], n[i + 2]) || 1;
            n[i] /= length; n[i + 1] /= length; n[i + 2] /= length;
        }
        normal.needsUpdate = true;
    }

    /** A scalar at the surface's vertices in the current frame; null if the body does not have it. */
    scalar(name) {
        if (name === "displacement") return this.atStart ? this.displacement() : null;
        const numbers = this.scalars[name];
        if (!numbers) return null;
        const ofNodes = numbers.read(this.frame, new Float32Array(this.nodeCount));
        return this.interpolate(ofNodes, new Float32Array(this.vertexCount), 1);
    }

    displacement() {
        const {x, atStart} = this, result = new Float32Array(this.vertexCount);
        for (let v = 0, i = 0; v < result.length; ++v, i += 3)
            result[v] = Math.hypot(x[i] - atStart[i], x[i + 1] - atStart[i + 1], x[i + 2] - atStart[i + 2]);
        return result;
    }

    /** Colours the whole surface with the body's own colour. */
    showColour() {
        const {r, g, b} = new THREE.Color(this.colour), colours = this.geometry.attributes.color;
        for (let i = 0; i < colours.array.length; i += 3) colours.array.set([r, g, b], i);
        colours.needsUpdate = true;
    }

    /** Colours the surface by numbers at its vertices, 0 to `high`. */
    showScalar(numbers, high) {
        const colours = this.geometry.attributes.color;
        for (let i = 0; i < this.vertexOf.length; ++i)
            putScaleColour(high > 0 ? numbers[this.vertexOf[i]] / high : 0, colours.array, 3 * i);
        colours.needsUpdate = true;
    }

    seeThrough(share) {
        this.material.transparent = share > 0;
        this.material.opacity = 1 - share;
        this.material.depthWrite = share < 0.05;
        this.material.side = share > 0 ? THREE.FrontSide : THREE.DoubleSide;
        this.material.needsUpdate = true;
    }
}

/** Box around all frames of all bodies. */
function boxOf(bodies) {
    const box = new THREE.Box3();
    for (const {nodes: {parts}} of bodies)
        for (const {low, step} of parts) {
            box.expandByPoint(new THREE.Vector3(...low));
            box.expandByPoint(new THREE.Vector3(...low.map((l, c) => l + 65535 * step[c])));
        }
    return box;
}
