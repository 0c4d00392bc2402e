// Light from the sky and from one lamp that throws shadows.
"use strict";

class Light {
    constructor(box, up) {
        this.up = up;
        this.group = new THREE.Group();
        const sky = new THREE.HemisphereLight(0xffffff, 0xc9cdd6, 0.68);
        sky.position.copy(up);
        this.lamp = new THREE.DirectionalLight(0xffffff, 0.5);
        this.lamp.castShadow = true;
        this.lamp.shadow.mapSize.set(2048, 2048);
        this.lamp.shadow.bias = -0.0008;
        this.lamp.shadow.radius = 2;
        // From behind the lamp, so that no side is flat.
        this.fill = new THREE.DirectionalLight(0xffffff, 0.16);
        this.group.add(sky, this.lamp, this.lamp.target, this.fill, this.fill.target);
        this.fit(box);
    }

    /** Lights what is in the box. */
    fit(box) {
        const {up, lamp, fill} = this, centre = box.getCenter(new THREE.Vector3());
        const radius = Math.max(0.5 * box.getSize(new THREE.Vector3()).length(), 1e-6);
        const side = Math.abs(up.z) > 0.5 ? new THREE.Vector3(0.55, -0.35, 0) : new THREE.Vector3(0.55, 0, 0.35);
        const towards = up.clone().add(side).normalize();
        lamp.position.copy(centre).addScaledVector(towards, 3 * radius);
        lamp.target.position.copy(centre);
        Object.assign(lamp.shadow.camera,
            {left: -1.1 * radius, right: 1.1 * radius, top: 1.1 * radius, bottom: -1.1 * radius, near: radius, far: 6 * radius});
        lamp.shadow.camera.updateProjectionMatrix();
        fill.position.copy(centre).addScaledVector(towards, -1).addScaledVector(up, 1.2 * radius);
        fill.target.position.copy(centre);
    }
}
