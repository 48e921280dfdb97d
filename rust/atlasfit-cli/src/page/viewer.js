// Shows the scene of the page: left and right the same view of two of its shows. In: the JSON that scene.rs
// writes. Needs WebGL 2 and nothing else. When the first picture is drawn, <body data-drawn> says so.
"use strict";
(() => {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const canvas = document.getElementById("view");
  const selects = document.querySelectorAll("#choose select");
  const legends = document.querySelectorAll("#legends > div");
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl || !scene.shows.length) {
    const words = gl ? "There is nothing to turn."
      : "This browser shows no 3D pictures (WebGL 2 is missing).";
    canvas.replaceWith(Object.assign(document.createElement("p"), { textContent: words }));
    document.getElementById("choose").remove();
    document.getElementById("help").remove();
    document.body.dataset.drawn = "no";
    return;
  }

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const shorts = (text) => new Uint16Array(bytes(text).buffer);
  const buffer = (data) => {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return made;
  };

  // Shaders. Positions come as whole numbers in a cube; 65535 three times: not shown.
  const place = `
    vec3 place(vec3 p) { return p * (65535.0 / 65534.0) - 0.5; }
    const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);`;
  const ofPoints = program(
    `in vec3 position; in vec3 normal; in vec3 color; uniform mat4 view; uniform float size; uniform vec3 eye;
    out vec3 tint; ${place}
    void main() {
      gl_Position = position == vec3(1.0) ? NOWHERE : view * vec4(place(position), 1.0);
      gl_PointSize = clamp(size / gl_Position.w, 1.5, 14.0);
      float length_ = length(normal);
      tint = color * (length_ > 0.1 ? 0.3 + 0.7 * abs(dot(normal / length_, eye)) : 1.0);
    }`,
    `in vec3 tint; out vec4 shown;
    void main() {
      vec2 d = gl_PointCoord - 0.5;
      if (dot(d, d) > 0.25) discard;
      shown = vec4(tint, 1.0);
    }`,
  );
  const ofFaces = program(
    `in vec3 position; in vec3 normal; in vec3 color; in vec2 uv; uniform mat4 view; uniform vec3 page;
    uniform bool flat_; out vec3 tint; out vec3 facing; out vec2 at; ${place}
    void main() {
      at = uv * page.z + page.xy;
      gl_Position = view * (flat_ ? vec4(at, 0.0, 1.0) : vec4(place(position), 1.0));
      tint = color;
      facing = normal;
    }`,
    `in vec3 tint; in vec3 facing; in vec2 at; uniform vec3 eye; uniform bool flat_; uniform bool checker;
    out vec4 shown;
    void main() {
      vec3 c = tint;
      float square = mod(floor(at.x * 32.0) + floor(at.y * 32.0), 2.0);
      if (checker) c = square < 0.5 ? vec3(0.93) : vec3(0.30, 0.42, 0.62);
      if (flat_) {
        shown = vec4(gl_FrontFacing ? c : vec3(0.0), 1.0);
      } else {
        if (!gl_FrontFacing) c = vec3(0.93, 0.55, 0.25);
        float length_ = length(facing);
        float light = length_ > 0.0 ? abs(dot(facing / length_, eye)) : 1.0;
        shown = vec4(c * (0.35 + 0.65 * light), 1.0);
      }
    }`,
  );
  const ofLines = program(
    `in vec3 position; uniform mat4 view; ${place}
    void main() { gl_Position = view * vec4(place(position), 1.0); gl_Position.z -= 0.001 * gl_Position.w; }`,
    `out vec4 shown; void main() { shown = vec4(0.85, 0.05, 0.05, 1.0); }`,
  );

  function program(vertex, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, `#version 300 es\nprecision highp float;\n${text}`);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) console.error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) console.error(gl.getProgramInfoLog(made));
    return made;
  }

  // The shapes, and a colour buffer for each show.
  const clouds = scene.clouds.map(({ xyz, normals }) => ({
    count: shorts(xyz).length / 3,
    xyz: buffer(shorts(xyz)),
    normals: normals && buffer(new Int8Array(bytes(normals).buffer)),
  }));
  const mesh = scene.mesh && surface(scene.mesh);
  const GREY = [189, 196, 204];
  const colors = scene.shows.map((show) => {
    const rgb = bytes(show.rgb);
    const colorOf = (i) => (rgb.length ? rgb.subarray(3 * i, 3 * i + 3) : GREY);
    if (show.of === "cloud") return buffer(filled(clouds[show.cloud].count, colorOf));
    return buffer(filled(mesh.count, show.of === "vertices" ? (i) => colorOf(mesh.vertex[i])
      : (i) => colorOf(Math.floor(i / 3))));
  });

  function filled(count, colorOf) {
    const all = new Uint8Array(3 * count);
    for (let i = 0; i < count; i++) all.set(colorOf(i), 3 * i);
    return all;
  }

  // The surface with its own three corners for each triangle.
  function surface(packed) {
    const xyz = shorts(packed.xyz);
    const vertex = new Uint32Array(bytes(packed.triangles).buffer);
    const normals = new Float32Array(xyz.length);
    const [a, b] = [new Float32Array(3), new Float32Array(3)];
    for (let t = 0; t < vertex.length; t += 3) {
      const [i, j, k] = [3 * vertex[t], 3 * vertex[t + 1], 3 * vertex[t + 2]];
      for (let d = 0; d < 3; d++) [a[d], b[d]] = [xyz[j + d] - xyz[i + d], xyz[k + d] - xyz[i + d]];
      for (let d = 0; d < 3; d++) {
        const area = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
        for (const v of [i, j, k]) normals[v + d] += area;
      }
    }
    const positions = new Uint16Array(3 * vertex.length);
    const facing = new Float32Array(3 * vertex.length);
    vertex.forEach((v, i) => {
      positions.set(xyz.subarray(3 * v, 3 * v + 3), 3 * i);
      facing.set(normals.subarray(3 * v, 3 * v + 3), 3 * i);
    });
    // Edges with one face.
    const MORE = 2 ** 32;
    const edges = new Map();
    for (let t = 0; t < vertex.length; t += 3) {
      for (let c = 0; c < 3; c++) {
        const [i, j] = [vertex[t + c], vertex[t + ((c + 1) % 3)]];
        const key = Math.min(i, j) * MORE + Math.max(i, j);
        edges.set(key, (edges.get(key) || 0) + 1);
      }
    }
    const single = [...edges].filter((e) => e[1] === 1);
    const open = single.flatMap(([key]) => [Math.floor(key / MORE), key % MORE]);
    const ends = new Uint16Array(3 * open.length);
    open.forEach((v, i) => ends.set(xyz.subarray(3 * v, 3 * v + 3), 3 * i));
    const uv = packed.uv;
    return {
      vertex, count: vertex.length, xyz: buffer(positions), normal: buffer(facing),
      uv: uv && buffer(shorts(uv.of_corners)), page: uv && [...uv.least, uv.side], most: uv && uv.most,
      edges: buffer(ends), ends: open.length,
    };
  }

  // The view, shared by both sides; the UVs have one of their own.
  const start = { yaw: 0.5, pitch: 0.35, near: 1, x: 0, y: 0, uvNear: 1, uvX: 0, uvY: 0 };
  const camera = { ...start, zUp: false };
  const FOV = 0.6;
  const times = (a, b) => Array.from({ length: 16 }, (_, i) =>
    [0, 1, 2, 3].reduce((sum, k) => sum + a[(i % 4) + 4 * k] * b[4 * Math.floor(i / 4) + k], 0));
  const away = () => 0.78 / Math.tan(FOV / 2) / camera.near * 0.5;

  function turned() {
    const [sy, cy] = [Math.sin(camera.yaw), Math.cos(camera.yaw)];
    const [sp, cp] = [Math.sin(camera.pitch), Math.cos(camera.pitch)];
    // Rows: right, up, towards the eye.
    const rows = [[cy, 0, -sy], [-sp * sy, cp, -sp * cy], [cp * sy, sp, cp * cy]];
    return camera.zUp ? rows.map(([x, y, z]) => [x, -z, y]) : rows;
  }

  function matrix(aspect) {
    const [r, u, e] = turned();
    const turn = [0, 1, 2].flatMap((k) => [r[k], u[k], e[k], 0]);
    const rigid = [...turn, camera.x, camera.y, -away(), 1];
    const f = 1 / Math.tan(FOV / 2) / Math.max(1, 1 / aspect);
    const [near, far] = [Math.max(0.002, away() - 1), away() + 1];
    const [depth, shift] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    const lens = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, depth, -1, 0, 0, shift, 0];
    return times(lens, rigid);
  }

  function flatMatrix(aspect) {
    const [x, y, side] = mesh.page;
    const [wide, high] = [mesh.most[0] - x, mesh.most[1] - y];
    const scale = (1.9 * camera.uvNear) / Math.max(high, wide / aspect);
    const [sx, sy] = [scale / aspect, scale];
    return [sx, 0, 0, 0, 0, sy, 0, 0, 0, 0, 1, 0,
      -sx * (x + wide / 2) + camera.uvX, -sy * (y + high / 2) + camera.uvY, 0, 1];
  }

  function attribute(program, name, data, width, type, normalized) {
    const at = gl.getAttribLocation(program, name);
    if (at < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, data);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, type, normalized, 0, 0);
  }

  function drawShow(number, aspect, height) {
    const show = scene.shows[number];
    const uniform = (p, name) => gl.getUniformLocation(p, name);
    const isFlat = show.of === "uvs";
    const view = isFlat ? flatMatrix(aspect) : matrix(aspect);
    for (let i = 0; i < 8; i++) gl.disableVertexAttribArray(i);
    if (show.of === "cloud") {
      const cloud = clouds[show.cloud];
      gl.useProgram(ofPoints);
      gl.uniformMatrix4fv(uniform(ofPoints, "view"), false, view);
      const size = (0.9 / Math.sqrt(cloud.count)) * height / Math.tan(FOV / 2) / 2;
      gl.uniform1f(uniform(ofPoints, "size"), size);
      gl.uniform3fv(uniform(ofPoints, "eye"), turned()[2]);
      attribute(ofPoints, "position", cloud.xyz, 3, gl.UNSIGNED_SHORT, true);
      if (cloud.normals) attribute(ofPoints, "normal", cloud.normals, 3, gl.BYTE, true);
      attribute(ofPoints, "color", colors[number], 3, gl.UNSIGNED_BYTE, true);
      gl.drawArrays(gl.POINTS, 0, cloud.count);
      return;
    }
    gl.useProgram(ofFaces);
    gl.uniformMatrix4fv(uniform(ofFaces, "view"), false, view);
    gl.uniform1i(uniform(ofFaces, "flat_"), isFlat);
    gl.uniform1i(uniform(ofFaces, "checker"), show.of === "checker");
    gl.uniform3fv(uniform(ofFaces, "page"), mesh.page || [0, 0, 1]);
    gl.uniform3fv(uniform(ofFaces, "eye"), turned()[2]);
    attribute(ofFaces, "position", mesh.xyz, 3, gl.UNSIGNED_SHORT, true);
    attribute(ofFaces, "normal", mesh.normal, 3, gl.FLOAT, false);
    attribute(ofFaces, "color", colors[number], 3, gl.UNSIGNED_BYTE, true);
    if (mesh.uv) attribute(ofFaces, "uv", mesh.uv, 2, gl.UNSIGNED_SHORT, true);
    gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
    if (isFlat || !mesh.ends) return;
    for (let i = 0; i < 8; i++) gl.disableVertexAttribArray(i);
    gl.useProgram(ofLines);
    gl.uniformMatrix4fv(uniform(ofLines, "view"), false, view);
    attribute(ofLines, "position", mesh.edges, 3, gl.UNSIGNED_SHORT, true);
    gl.drawArrays(gl.LINES, 0, mesh.ends);
  }

  function draw() {
    waiting = false;
    const sharp = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth * sharp, canvas.clientHeight * sharp].map(Math.round);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(1, 1, 1, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const half = Math.floor(width / 2);
    gl.enable(gl.SCISSOR_TEST);
    selects.forEach((select, side) => {
      gl.viewport(side * half, 0, half, height);
      gl.scissor(side * half, 0, half, height);
      drawShow(Number(select.value), half / height, height);
    });
    const error = gl.getError();
    if (error) console.error(`WebGL error ${error}`);
    document.body.dataset.drawn = "yes";
  }
  let waiting = false;
  function later() {
    if (!waiting) requestAnimationFrame(draw);
    waiting = true;
  }

  // What is chosen, and what its colours mean. page.html#2,5 opens with these two, counted from 0.
  const chosen = /^#(\d+),(\d+)$/.exec(location.hash);
  selects.forEach((select, side) => {
    scene.shows.forEach((show, i) => select.add(new Option(show.name, i)));
    select.value = chosen ? chosen[side + 1] : scene.start[side];
    const tell = () => {
      const legend = scene.shows[Number(select.value)].legend;
      legends[side].replaceChildren();
      if (legend) {
        const bar = document.createElement("i");
        bar.style.background = `linear-gradient(90deg, ${legend.colors.map((c) => `rgb(${c})`).join(", ")})`;
        legends[side].append(legend.from, bar, legend.to);
      }
      later();
    };
    select.addEventListener("change", tell);
    tell();
  });

  // Mouse, fingers, keys.
  const fingers = new Map();
  const sideAt = (e) => (e.offsetX < canvas.clientWidth / 2 ? 0 : 1);
  const isFlat = (side) => scene.shows[Number(selects[side].value)].of === "uvs";
  let heldSide = 0;
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("pointerdown", (e) => {
    fingers.set(e.pointerId, [e.offsetX, e.offsetY]);
    heldSide = sideAt(e);
    canvas.setPointerCapture(e.pointerId);
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (e) => fingers.delete(e.pointerId));
  }
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const now = [e.offsetX, e.offsetY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    const other = [...fingers].find(([id]) => id !== e.pointerId);
    if (other) {
      const apart = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]);
      zoom(apart(now) / Math.max(1, apart(before)), heldSide);
    } else if (isFlat(heldSide)) {
      camera.uvX += (4 * dx) / canvas.clientWidth;
      camera.uvY -= (2 * dy) / canvas.clientHeight;
    } else if (e.shiftKey || e.buttons & 6) {
      const step = (2 * Math.tan(FOV / 2) * away()) / canvas.clientHeight;
      camera.x += step * dx;
      camera.y -= step * dy;
    } else {
      camera.yaw -= 0.01 * dx;
      camera.pitch = Math.min(1.57, Math.max(-1.57, camera.pitch + 0.01 * dy));
    }
    fingers.set(e.pointerId, now);
    later();
  });
  function zoom(factor, side) {
    const name = isFlat(side) ? "uvNear" : "near";
    camera[name] = Math.min(60, Math.max(0.2, camera[name] * factor));
    later();
  }
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom(Math.exp(-0.0015 * e.deltaY), sideAt(e));
  }, { passive: false });
  canvas.addEventListener("dblclick", () => { Object.assign(camera, start); later(); });
  canvas.addEventListener("keydown", (e) => {
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
    if (turn) {
      camera.yaw += 0.1 * turn[0];
      camera.pitch = Math.min(1.57, Math.max(-1.57, camera.pitch + 0.1 * turn[1]));
      e.preventDefault();
    } else if (e.key === "+" || e.key === "-") zoom(e.key === "+" ? 1.2 : 1 / 1.2, 1);
    else if (e.key === "z" || e.key === "Z") camera.zUp = !camera.zUp;
    else return;
    later();
  });
  new ResizeObserver(later).observe(canvas);
})();
