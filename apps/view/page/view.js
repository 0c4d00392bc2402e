// The picture: canvas, camera and orbiting. Draws only when something has changed.
"use strict";

class View {
    constructor(canvas, box, up) {
        Object.assign(this, {canvas, box, up});
        this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, alpha: true});
        this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
        this.renderer.shadowMap.enabled = true;
        this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
        this.scene = new THREE.Scene();
        this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
        this.camera.up.copy(up);
        this.controls = new THREE.OrbitControls(this.camera, canvas);
        this.controls.enableKeys = false;
        this.controls.screenSpacePanning = true;
        this.controls.addEventListener("change", () => this.change());
        this.isHeld = false;  // whether the reader has chosen where to look from
        this.controls.addEventListener("start", () => { this.isHeld = true; });
        canvas.addEventListener("wheel", () => { this.isHeld = true; });
        this.isStale = true;
        this.drawn = 0;
        new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
        this.resize();
        this.lookAt(box);
        const draw = () => {
            requestAnimationFrame(draw);
            if (this.isStale) this.draw();
        };
        draw();
    }

    change() { this.isStale = true; }

    draw() {
        this.isStale = false;
        this.renderer.render(this.scene, this.camera);
        ++this.drawn;
    }

    resize() {
        const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
        if (!width || !height) return;
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        this.change();
    }

    /** Looks at a box from the side and from above, so that it fills the part of the picture that nothing covers. */
    lookAt(box) {
        this.isHeld = false;
        const {camera, up} = this, centre = box.getCenter(new THREE.Vector3());
        const side = Math.abs(up.z) > 0.5 ? new THREE.Vector3(0.5, 0.87, 0) : new THREE.Vector3(0.5, 0, -0.87);
        side.addScaledVector(up, -side.dot(up)).normalize();
        const forward = side.addScaledVector(up, -0.38).normalize();
        const right = forward.clone().cross(up).normalize(), above = right.clone().cross(forward);
        const tangent = Math.tan(camera.fov * Math.PI / 360), room = this.room();
        // The distance from which each corner of the box is inside the free part. A corner that lies p to the right
        // and d behind the centre is seen at (p + middle distance t) / ((distance + d) t), where t is the tangent of
        // half the view's angle and `middle` that of the free part, as the target is shifted by it.
        let distance = 1e-3;
        const fit = (p, d, t, middle, half) => {
            distance = Math.max(distance, (p / t - (middle + half) * d) / half, (-p / t + (middle - half) * d) / half,
                -1.1 * d);
        };
        for (let corner = 0; corner < 8; ++corner) {
            const p = new THREE.Vector3(
                corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y, corner & 4 ? box.max.z : box.min.z).sub(centre);
            const depth = p.dot(forward);
            fit(p.dot(right), depth, tangent * camera.aspect, room.right, room.width);
            fit(p.dot(above), depth, tangent, room.up, room.height);
        }
        distance *= 1.06;
        const shift = above.clone().multiplyScalar(-room.up * distance * tangent)
            .addScaledVector(right, -room.right * distance * tangent * camera.aspect);
        this.controls.target.copy(centre).add(shift);
        camera.position.copy(this.controls.target).addScaledVector(forward, -distance);
        camera.near = distance / 100;
        camera.far = distance * 40;
        camera.updateProjectionMatrix();
        this.controls.minDistance = distance / 30;
        this.controls.maxDistance = distance * 8;
        this.controls.update();
        this.change();
    }

    /** The part of the picture that no panel covers, as shares of its half width and height, and its centre. */
    room() {
        const stage = this.canvas.getBoundingClientRect();
        const cover = (id) => {
            const element = document.getElementById(id);
            // Elements of a fixed place have no offsetParent, so this alone tells whether one is shown.
            return element && element.getClientRects().length > 0 ? element.getBoundingClientRect() : null;
        };
        const panel = cover("panel"), title = cover("title"), transport = cover("transport");
        const top = title ? Math.min(title.bottom / stage.height, 0.3) : 0;
        const bottom = transport ? Math.min((stage.bottom - transport.top) / stage.height, 0.3) : 0;
        const aside = panel && stage.width > 720 ? (stage.right - panel.left) / stage.width : 0;
        return {width: 1 - aside, height: 1 - top - bottom, up: bottom - top, right: -aside};
    }

    /** Turns the camera about the target by degrees to the right and up. */
    orbit(right, above) {
        this.isHeld = true;
        const {camera, controls, up} = this, offset = camera.position.clone().sub(controls.target);
        const across = offset.clone().cross(up).normalize();
        const angle = offset.angleTo(up) * 180 / Math.PI;
        const tilt = Math.min(Math.max(angle - above, 4), 176) - angle;
        offset.applyAxisAngle(across, -tilt * Math.PI / 180);
        offset.applyAxisAngle(up, right * Math.PI / 180);
        camera.position.copy(controls.target).add(offset);
        controls.update();
        this.change();
    }

    /** Moves the camera to `factor` times its distance. */
    zoom(factor) {
        this.isHeld = true;
        const {camera, controls} = this, offset = camera.position.clone().sub(controls.target);
        camera.position.copy(controls.target).addScaledVector(offset, factor);
        controls.update();
        this.change();
    }
}
