"""Judges atlasfit's UVs and compares them with a peer's, mesh by mesh.

usage: unwrap_peers.py BENCH_BINARY EVAL_DIR PEER.jsonl MESH... [--stretch S] [--pictures DIR]
EVAL_DIR holds uvmetrics.py; PEER.jsonl holds lines of uvpeers.py (made once, on the same machine).
Prints a line per mesh, then medians of the per-mesh ratios to the peer.
"""
import json, os, re, subprocess, sys, tempfile
from statistics import median

import numpy as np, trimesh


def load(p):
    m = trimesh.load(p, process=False, force="mesh")
    return np.asarray(m.vertices, float), np.asarray(m.faces, np.int64)


def picture(path, uv, chart_of):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    rng = np.random.default_rng(1)
    colour = rng.uniform(0.3, 0.95, (chart_of.max() + 1, 3))
    fig, ax = plt.subplots(figsize=(9, 9))
    ax.add_collection(PolyCollection(uv, facecolors=colour[chart_of], edgecolors=(0, 0, 0, 0.25), linewidths=0.2))
    ax.set_xlim(0, 1), ax.set_ylim(0, 1), ax.set_aspect("equal")
    fig.savefig(path, dpi=90, bbox_inches="tight"), plt.close(fig)


def main():
    args = sys.argv[1:]
    option = {}
    for name in ("--stretch", "--pictures", "--json"):
        if name in args:
            i = args.index(name)
            option[name] = args[i + 1]
            del args[i : i + 2]
    bench, evaldir, peerfile, *meshes = args
    sys.path.insert(0, evaldir)
    from uvmetrics import metrics

    peer = {}
    for line in open(peerfile):
        d = json.loads(line)
        peer[d["mesh"]] = d
    out = tempfile.mkdtemp()
    extra = ["--stretch", option["--stretch"]] if "--stretch" in option else []
    text = subprocess.run([bench, *extra, "--out", out, *meshes], capture_output=True, text=True)
    print(text.stderr[-2000:])
    time = {l.split()[0]: (float(re.search(r" t ([\d.]+)", l)[1]), l[l.index(" segment") :]) for l in text.stdout.splitlines() if " t " in l}
    for l in text.stdout.splitlines():
        if " error " in l:
            print(l)
    rows = []
    for path in meshes:
        name = os.path.splitext(os.path.basename(path))[0]
        if name not in time:
            continue
        v, f = load(path)
        raw = open(f"{out}/{name}.uv", "rb").read()
        uv = np.frombuffer(raw, np.float32, 6 * len(f)).reshape(-1, 3, 2).astype(float)
        page = np.frombuffer(raw, np.uint32, len(f), 24 * len(f)).astype(int)
        d = metrics(v, f, uv, page)
        d["t"] = time[name][0]
        d["mesh"] = name + ".ply"
        rows.append(d)
        p = peer.get(d["mesh"], {})
        r = lambda k: d[k] / max(p[k], 1e-9) if k in p else float("nan")
        print(
            f"{name:20s} F{d['faces']:7d} charts {d['charts']:4d} ({r('charts'):.2f}) seam {d['seam']:6.2f} ({r('seam'):.2f})"
            f" sd95 {d['sd95']:.3f} L2 {d['L2']:.3f} flips {d['flips']} deg {d['deg']} ov {d['overlap']:.5f} in {d['inside']}"
            f" cover {d['cover']:.3f} ({r('cover'):.2f}) t {d['t']:.3f} ({r('t'):.2f}) {time[name][1]}",
            flush=True,
        )
        if "--pictures" in option:
            os.makedirs(option["--pictures"], exist_ok=True)
            chart = np.unique(np.frombuffer(raw[28 * len(f) :], np.uint32, len(f)), return_inverse=True)[1]
            picture(f"{option['--pictures']}/{name}.png", uv, chart)
    if "--json" in option:
        with open(option["--json"], "w") as w:
            for d in rows:
                w.write(json.dumps({**d, "peer": "atlasfit"}) + "\n")
    ok = [(d, peer[d["mesh"]]) for d in rows if d["mesh"] in peer and "error" not in peer[d["mesh"]]]
    m = lambda k: median(d[k] for d in rows)
    print(f"{len(rows)} meshes: charts {m('charts')} seam {m('seam'):.2f} sd95 median {m('sd95'):.3f} worst {max(d['sd95'] for d in rows):.3f} cover {m('cover'):.3f} t {m('t'):.3f}")
    print("flips in", sum(d["flips"] > 0 for d in rows), "overlap in", sum(d["overlap"] > 0 for d in rows), "degenerate in", sum(d["deg"] > 0 for d in rows), "outside in", sum(not d["inside"] for d in rows))
    print("ratios", {k: round(median(a[k] / max(b[k], 1e-9) for a, b in ok), 3) for k in ("charts", "seam", "sd95", "cover", "t")})


main()
