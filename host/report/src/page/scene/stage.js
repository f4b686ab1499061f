"use strict";
// Sets three.js up in the page's stage, with the camera turned by the pointer or the keyboard. Returns what a page draws with; nothing
// where WebGL is missing, which a message then says.
function openStage() {
  const stage = document.getElementById("stage");
  const style = getComputedStyle(document.documentElement);
  const color = (name) => new THREE.Color(style.getPropertyValue(`--${name}`).trim());
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true });
  } catch (error) {
    document.getElementById("message").textContent = "This browser does not offer WebGL, so the mesh cannot be shown here.";
    return null;
  }
  renderer.setPixelRatio(devicePixelRatio);
  stage.prepend(renderer.domElement);
  renderer.domElement.setAttribute("role", "application");
  renderer.domElement.tabIndex = 0;
  renderer.domElement.setAttribute("aria-label", document.querySelector("#scene figcaption").textContent);
  const ground = color("ground");
  const scene = new THREE.Scene();
  scene.background = ground;
  const camera = new THREE.PerspectiveCamera(35, 1, 1, 100);
  camera.up.set(0, 0, 1);
  scene.add(camera, new THREE.HemisphereLight(0xffffff, 0x8890a0, 1.6));
  const lamp = new THREE.DirectionalLight(0xffffff, 2.2);
  lamp.position.set(-1, 1.2, 1);
  camera.add(lamp);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);

  // Looks at a box from so many times its half diagonal: the flatter it lies, the more from above.
  const look = (low, high, far = 4.2) => {
    const reach = high.clone().sub(low).length() / 2;
    const flatness = Math.min(1, (high.z - low.z) / Math.min(high.x - low.x, high.y - low.y));
    [camera.near, camera.far] = [reach / 50, reach * 50];
    camera.position.set(0.55, -0.95, 2 - 1.5 * flatness).normalize().multiplyScalar(reach * far);
    camera.updateProjectionMatrix();
    controls.update();
  };

  // A mesh: outside in gray, inside in the warning color. A little back, so that edges show on it; the inside a little
  // further, so that it does not shine through a rim.
  const outside = new THREE.MeshStandardMaterial({ color: 0xb9c0c9, roughness: 0.6, side: THREE.FrontSide });
  const inside = new THREE.MeshBasicMaterial({ color: color("back"), side: THREE.BackSide });
  outside.polygonOffset = inside.polygonOffset = true;
  outside.polygonOffsetFactor = outside.polygonOffsetUnits = 1;
  inside.polygonOffsetFactor = inside.polygonOffsetUnits = 3;
  const body = (geometry) => {
    const both = new THREE.Group();
    both.add(new THREE.Mesh(geometry, outside), new THREE.Mesh(geometry, inside));
    return both;
  };

  // Nothing moves by itself, so a frame is drawn only when something changed.
  const drawn = [];
  const render = () => {
    renderer.render(scene, camera);
    for (const act of drawn) act();
  };
  let waiting = false;
  const draw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      render();
    });
  };
  controls.addEventListener("change", draw);
  // A printer gets a picture, since it may ask for the drawing when it is gone.
  const picture = Object.assign(new Image(), { alt: "" });
  addEventListener("beforeprint", () => {
    render();
    stage.prepend(picture);
    picture.src = renderer.domElement.toDataURL();
  });

  // Arrow keys turn by a 24th of a full turn, + and − zoom.
  const STEP = Math.PI / 12, ZOOM = 1.15;
  const turned = (across, up) => {
    const offset = camera.position.clone().sub(controls.target);
    offset.applyAxisAngle(camera.up, across * STEP);
    const side = new THREE.Vector3().crossVectors(camera.up, offset).normalize();
    const angle = offset.angleTo(camera.up);
    // Never over a pole, where up and down change places.
    const to = Math.min(Math.max(angle - up * STEP, 0.02), Math.PI - 0.02);
    return offset.applyAxisAngle(side, to - angle);
  };
  const zoomed = (factor) => camera.position.clone().sub(controls.target).multiplyScalar(factor);
  const KEYS = {
    ArrowLeft: () => turned(-1, 0), ArrowRight: () => turned(1, 0), ArrowUp: () => turned(0, 1), ArrowDown: () => turned(0, -1),
    "+": () => zoomed(1 / ZOOM), "=": () => zoomed(1 / ZOOM), "-": () => zoomed(ZOOM),
  };
  renderer.domElement.addEventListener("keydown", (event) => {
    const offset = event.ctrlKey || event.metaKey || event.altKey ? null : KEYS[event.key]?.();
    if (!offset) return;
    event.preventDefault();
    camera.position.copy(controls.target).add(offset);
    controls.update();
  });

  const ray = new THREE.Raycaster();
  // The ray under the pointer.
  const under = (event) => {
    const box = renderer.domElement.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width * 2 - 1, y = 1 - (event.clientY - box.top) / box.height * 2;
    ray.setFromCamera(new THREE.Vector2(x, y), camera);
    return ray;
  };
  // Calls back where the pointer was pressed and released without having moved.
  let pressed = null;
  const onClick = (act) => {
    renderer.domElement.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
    renderer.domElement.addEventListener("pointerup", (event) => {
      if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4) act(under(event));
    });
  };

  const fit = () => {
    const { clientWidth: width, clientHeight: height } = stage;
    const now = renderer.getSize(new THREE.Vector2());
    if (width === 0 || height === 0 || (now.x === width && now.y === height)) return;
    renderer.setSize(width, height);
    camera.aspect = width / height;
    // What fits a narrow window's width fits its height.
    camera.fov = width < height ? 2 * Math.atan(Math.tan(17.5 * Math.PI / 180) / camera.aspect) * 180 / Math.PI : 35;
    camera.updateProjectionMatrix();
    // At once: the new size has cleared the drawing.
    render();
  };
  // Called once everything is there.
  const open = () => {
    fit();
    new ResizeObserver(fit).observe(stage);
  };
  return { stage, canvas: renderer.domElement, scene, camera, ground, outside, color, look, body, drawn, draw, under, onClick, open };
}
