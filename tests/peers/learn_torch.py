#!/usr/bin/env python3
"""A recipe of `atlasfit learn train` in PyTorch, as a user of PyTorch would write it: the peer for speed. The
same model, batches of random numbers of the same sizes, the same loss with exact nearest neighbours (by trees
on a CPU, by all distances on a GPU); Adam. Prints images per second: shapes trained on per second, each from one
image, and with `quick` from its points too.

usage: learn_torch.py [quick|quick-conv|atlasnet|convatlas] [STEPS] [cpu|cuda]. Needs torch and scipy.
"""

import sys
import time

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import nn

BATCH = 32
# Of each recipe: points, numbers of the code, pixels, width of the image encoder, whether points are encoded.
SIZES = {
    "quick": (640, 128, 64, 8, True),
    "quick-conv": (640, 128, 64, 8, True),
    "atlasnet": (2500, 1024, 224, 64, False),
    "convatlas": (4096, 512, 224, 64, False),
}


class PointNet(nn.Module):
    def __init__(self, code, units=(32, 64, 192)):
        super().__init__()
        layers, inputs = [], 3
        for i, n in enumerate(units):
            layers += [nn.Conv1d(inputs, n, 1, bias=False), nn.BatchNorm1d(n)]
            layers += [nn.ReLU()] if i + 1 < len(units) else []
            inputs = n
        self.each = nn.Sequential(*layers)
        self.code = nn.Sequential(nn.Linear(inputs, code, bias=False), nn.BatchNorm1d(code), nn.ReLU())

    def forward(self, x):
        return self.code(self.each(x.transpose(1, 2)).max(2).values)


def conv(inputs, outputs, side, stride, relu):
    layers = [nn.Conv2d(inputs, outputs, side, stride, side // 2, bias=False), nn.BatchNorm2d(outputs)]
    return nn.Sequential(*layers, *([nn.ReLU()] if relu else []))


class Block(nn.Module):
    def __init__(self, inputs, outputs, stride):
        super().__init__()
        self.path = nn.Sequential(conv(inputs, outputs, 3, stride, True), conv(outputs, outputs, 3, 1, False))
        self.own = conv(inputs, outputs, 1, stride, False) if stride > 1 else nn.Identity()

    def forward(self, x):
        return torch.relu(self.path(x) + self.own(x))


class ResNet(nn.Module):
    def __init__(self, code, width):
        super().__init__()
        blocks, inputs = [], width
        for stage in range(4):
            blocks += [Block(inputs, width << stage, 2), Block(width << stage, width << stage, 1)]
            inputs = width << stage
        self.blocks = nn.Sequential(conv(2, width, 7, 2, True), *blocks)
        self.code = nn.Sequential(nn.Linear(inputs, code, bias=False), nn.BatchNorm1d(code), nn.ReLU())

    def forward(self, x):
        return self.code(self.blocks(x).mean((2, 3)))


class AtlasNet(nn.Module):
    """All charts at once: the first layer is the sum of its products with the code and with the place."""

    def __init__(self, inputs, charts=8, hidden=(96, 64), side=9):
        super().__init__()

        def weight(inputs, outputs):
            return nn.Parameter((torch.rand(charts, inputs, outputs) * 2 - 1) / np.sqrt(inputs))

        self.charts, self.side = charts, side
        self.of_code, self.of_place = weight(inputs, hidden[0]), weight(2, hidden[0])
        layers = zip(hidden, [*hidden[1:], 3])
        self.weights = nn.ParameterList([weight(a, b) for a, b in layers])
        self.bias = nn.Parameter(torch.zeros(charts, 1, 3))
        self.norms = nn.ModuleList([nn.BatchNorm1d(charts * n) for n in hidden])
        t = torch.linspace(0, 1, side)
        places = torch.stack(torch.meshgrid(t, t, indexing="ij"), -1).reshape(1, -1, 2)
        self.register_buffer("places", places)

    def forward(self, code):
        k, n, shapes = self.charts, self.side**2, len(code)
        a = torch.matmul(code[None], self.of_code)
        b = torch.matmul(self.places, self.of_place)
        x = (a[:, :, None] + b[:, None]).reshape(k, shapes * n, -1)
        for norm, w in zip(self.norms, self.weights):
            rows = x.permute(1, 0, 2).reshape(shapes * n, -1)
            x = torch.relu(norm(rows)).reshape(shapes * n, k, -1).permute(1, 0, 2)
            x = torch.bmm(x, w)
        x = torch.tanh(x + self.bias).reshape(k, shapes, n, 3)
        return x.transpose(0, 1)


class ConvAtlas(nn.Module):
    """Charts are the groups of one convolution each; the first one sees the same picture in every chart."""

    def __init__(self, code, charts=1, channels=128):
        super().__init__()
        self.charts, self.channels, self.side = charts, channels, 32
        start = 16 * channels
        first = nn.Linear(code, start, bias=False)
        self.start = nn.Sequential(first, nn.BatchNorm1d(start), nn.LeakyReLU(0.2))
        blocks = []
        for i in range(3):
            blocks.append(nn.Upsample(scale_factor=2, mode="bilinear", align_corners=False))
            inputs, groups = (channels >> i) * (charts if i else 1), charts if i else 1
            outputs = (channels >> (i + 1) if i < 2 else 3) * charts
            blocks.append(nn.Conv2d(inputs, outputs, 3, 1, 1, bias=i == 2, groups=groups))
            blocks += [nn.BatchNorm2d(outputs), nn.LeakyReLU(0.2)] if i < 2 else [nn.Tanh()]
        self.blocks = nn.Sequential(*blocks)

    def forward(self, code):
        x = self.blocks(self.start(code).reshape(len(code), self.channels, 4, 4))
        return x.reshape(len(code), self.charts, 3, -1).transpose(2, 3)


def nearest_by_trees(samples, points):
    near = [[], []]
    answers, truth = samples.numpy(), points.numpy()
    trees = [cKDTree(t) for t in truth]
    for i, s in enumerate(answers):
        near[0].append(trees[i % len(trees)].query(s, workers=-1)[1])
        near[1].append(cKDTree(s).query(truth[i % len(truth)], workers=-1)[1])
    return [torch.from_numpy(np.stack(n)) for n in near]


def nearest_by_all(samples, points):
    near = [[], []]
    for s, t in zip(samples, points.repeat(len(samples) // len(points), 1, 1)):
        far = torch.cdist(s, t)
        near[0].append(far.argmin(1))
        near[1].append(far.argmin(0))
    return [torch.stack(n) for n in near]


def chamfer(samples, points):
    nearest = nearest_by_all if samples.is_cuda else nearest_by_trees
    picked = [n[..., None].expand(-1, -1, 3) for n in nearest(samples.detach(), points)]
    target = points.repeat(len(samples) // len(points), 1, 1)
    there = (samples - target.gather(1, picked[0])).square().sum(-1).mean()
    return there + (samples.gather(1, picked[1]) - target).square().sum(-1).mean()


def stretch(samples, side):
    q = samples.reshape(*samples.shape[:2], side, side, 3)
    edges = (q[:, :, 1:] - q[:, :, :-1]).square().sum() + (q[:, :, :, 1:] - q[:, :, :, :-1]).square().sum()
    return 2 * edges / side**2 / len(samples)


def main():
    torch.manual_seed(1)
    name = sys.argv[1] if len(sys.argv) > 1 else "quick"
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 30
    device = sys.argv[3] if len(sys.argv) > 3 else "cpu"
    points, code, pixels, width, both = SIZES[name]
    nets = [PointNet(code)] if both else []
    nets.append(ResNet(code, width))
    decoder = {
        "quick": lambda: AtlasNet(code),
        "quick-conv": lambda: ConvAtlas(code),
        "atlasnet": lambda: AtlasNet(code, 25, (1026, 513, 256), 10),
        "convatlas": lambda: ConvAtlas(code, 32),
    }[name]()
    for net in (*nets, decoder):
        net.to(device)
    every = [p for net in (*nets, decoder) for p in net.parameters()]
    print(f"{sum(p.numel() for p in every)} parameters, {torch.get_num_threads()} threads, {device}")
    adam = torch.optim.Adam(every, lr=2e-3)
    started = None
    for step in range(steps + 3):
        if step == 3:
            started = time.time()
        shapes = torch.rand(BATCH, points, 3, device=device) - 0.5
        inputs = [shapes] if both else []
        inputs.append(torch.rand(BATCH, 2, pixels, pixels, device=device))
        samples = decoder(torch.cat([net(x) for net, x in zip(nets, inputs)]))
        loss = chamfer(samples.reshape(len(samples), -1, 3), shapes) + 0.01 * stretch(samples, decoder.side)
        adam.zero_grad()
        loss.backward()
        adam.step()
        loss.item()
    print(f"{name}: {steps * BATCH / (time.time() - started):.1f} images/s")


if __name__ == "__main__":
    main()
