// A plane as a floor: a disc with a grid that fades out around the bodies, and their shadows.
"use strict";

/** 1, 2 or 5 times a power of ten. */
function roundLength(length) {
    const power = 10 ** Math.floor(Math.log10(length)), factor = length / power;
    return power * (factor < 1.5 ? 1 : factor < 3.5 ? 2 : factor < 7.5 ? 5 : 10);
}

const gridShader = {
    vertexShader: `
        varying vec2 place;
        void main() {
            place = position.xy;
            gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
        }`,
    fragmentShader: `
        varying vec2 place;
        uniform float cell, reach;
        uniform vec2 centre;
        float lines(float width) {
            vec2 at = place / width, wide = fwidth(at);
            vec2 near = abs(fract(at - 0.5) - 0.5) / max(wide, vec2(1e-6));
            return (1.0 - min(min(near.x, near.y), 1.0)) * (1.0 - smoothstep(0.25, 0.6, max(wide.x, wide.y)));
        }
        void main() {
            float fade = 1.0 - smoothstep(0.35, 1.0, length(place - centre) / reach);
            float line = max(0.34 * lines(cell), 0.6 * lines(5.0 * cell));
            vec3 colour = mix(vec3(0.975, 0.98, 0.99), vec3(0.60, 0.66, 0.74), line);
            gl_FragColor = vec4(colour, fade);
        }`,
};

/** Returns a group, in the place of the plane before it moves. box: around the bodies. cell: between grid lines. */
function makeFloor({point, normal}, box, cell) {
    const n = new THREE.Vector3(...normal), p = new THREE.Vector3(...point);
    const group = new THREE.Group();
    const centre = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3()).length();
    // Its own origin is that point of the plane that is nearest to the world's, so that grid lines are at whole cells.
    const origin = n.clone().multiplyScalar(p.dot(n));
    group.position.copy(origin);
    group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), n);
    const local = centre.clone().sub(origin).applyQuaternion(group.quaternion.clone().inverse());
    const reach = 2.6 * size;
    const disc = new THREE.CircleBufferGeometry(reach, 64);
    disc.translate(local.x, local.y, 0);
    const grid = new THREE.Mesh(disc, new THREE.ShaderMaterial({
        ...gridShader, transparent: true, depthWrite: false, extensions: {derivatives: true},
        uniforms: {cell: {value: cell}, reach: {value: reach}, centre: {value: new THREE.Vector2(local.x, local.y)}},
    }));
    grid.renderOrder = -2;
    const shadow = new THREE.Mesh(disc, new THREE.ShadowMaterial({opacity: 0.2, depthWrite: false}));
    shadow.position.z = 2e-4 * size;
    shadow.receiveShadow = true;
    shadow.renderOrder = -1;
    // Hides what lies behind the plane, without a colour of its own.
    const solid = new THREE.Mesh(disc, new THREE.MeshBasicMaterial({colorWrite: false}));
    solid.position.z = -2e-4 * size;
    solid.renderOrder = -3;
    group.add(grid, shadow, solid);
    return group;
}
