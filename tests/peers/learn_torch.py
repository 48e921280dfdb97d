#!/usr/bin/env python3
"""The recipe `quick` (or `quick-conv`) of `atlasfit learn train` in PyTorch, as a user of PyTorch would write
it: the peer for speed. The same model, batches of random numbers of the same sizes, the same loss with exact
nearest neighbours; Adam. Prints images per second: shapes trained on per second, each from its points and from
one image.

usage: learn_torch.py [quick|quick-conv] [STEPS]. Needs torch and scipy.
"""

import sys
import time

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import nn

BATCH, POINTS, CODE, PIXELS = 32, 640, 128, 64


class PointNet(nn.Module):
    def __init__(self, units=(32, 64, 192)):
        super().__init__()
        layers, inputs = [], 3
        for i, n in enumerate(units):
            layers += [nn.Conv1d(inputs, n, 1, bias=False), nn.BatchNorm1d(n)]
            layers += [nn.ReLU()] if i + 1 < len(units) else []
            inputs = n
        self.each = nn.Sequential(*layers)
        self.code = nn.Sequential(nn.Linear(inputs, CODE, bias=False), nn.BatchNorm1d(CODE), nn.ReLU())

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
    def __init__(self, width=8):
        super().__init__()
        blocks, inputs = [], width
        for stage in range(4):
            blocks += [Block(inputs, width << stage, 2), Block(width << stage, width << stage, 1)]
            inputs = width << stage
        self.blocks = nn.Sequential(conv(2, width, 7, 2, True), *blocks)
        self.code = nn.Sequential(nn.Linear(inputs, CODE, bias=False), nn.BatchNorm1d(CODE), nn.ReLU())

    def forward(self, x):
        return self.code(self.blocks(x).mean((2, 3)))


class AtlasNet(nn.Module):
    """All charts at once: the first layer is the sum of its products with the code and with the place."""

    def __init__(self, charts=8, hidden=(96, 64), side=9):
        super().__init__()

        def weight(inputs, outputs):
            return nn.Parameter((torch.rand(charts, inputs, outputs) * 2 - 1) / np.sqrt(inputs))

        self.charts, self.side = charts, side
        self.of_code, self.of_place = weight(CODE, hidden[0]), weight(2, hidden[0])
        self.weights = nn.ParameterList([weight(hidden[0], hidden[1]), weight(hidden[1], 3)])
        self.bias = nn.Parameter(torch.zeros(charts, 1, 3))
        self.norms = nn.ModuleList([nn.BatchNorm1d(charts * n) for n in hidden])
        t = torch.linspace(0, 1, side)
        self.places = torch.stack(torch.meshgrid(t, t, indexing="ij"), -1).reshape(1, -1, 2)

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
    def __init__(self, channels=128):
        super().__init__()
        self.channels, self.side = channels, 32
        start = 16 * channels
        first = nn.Linear(CODE, start, bias=False)
        self.start = nn.Sequential(first, nn.BatchNorm1d(start), nn.LeakyReLU(0.2))
        blocks = []
        for i in range(3):
            blocks.append(nn.Upsample(scale_factor=2, mode="bilinear", align_corners=False))
            outputs = channels >> (i + 1) if i < 2 else 3
            blocks.append(nn.Conv2d(channels >> i, outputs, 3, 1, 1, bias=i == 2))
            blocks += [nn.BatchNorm2d(outputs), nn.LeakyReLU(0.2)] if i < 2 else [nn.Tanh()]
        self.blocks = nn.Sequential(*blocks)

    def forward(self, code):
        x = self.blocks(self.start(code).reshape(len(code), self.channels, 4, 4))
        return x.permute(0, 2, 3, 1).reshape(len(code), 1, -1, 3)


def chamfer(samples, points):
    near = [[], []]
    answers = samples.detach().numpy()
    truth = points.numpy()
    trees = [cKDTree(t) for t in truth]
    for i, s in enumerate(answers):
        near[0].append(trees[i % len(trees)].query(s, workers=-1)[1])
        near[1].append(cKDTree(s).query(truth[i % len(truth)], workers=-1)[1])
    target = points.repeat(len(samples) // len(points), 1, 1)
    picked = [torch.from_numpy(np.stack(n))[..., None].expand(-1, -1, 3) for n in near]
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
    points_net, image_net = PointNet(), ResNet()
    decoder = ConvAtlas() if name == "quick-conv" else AtlasNet()
    every = [p for net in (points_net, image_net, decoder) for p in net.parameters()]
    print(f"{sum(p.numel() for p in every)} parameters, {torch.get_num_threads()} threads")
    adam = torch.optim.Adam(every, lr=2e-3)
    started = None
    for step in range(steps + 3):
        if step == 3:
            started = time.time()
        points = torch.rand(BATCH, POINTS, 3) - 0.5
        images = torch.rand(BATCH, 2, PIXELS, PIXELS)
        samples = decoder(torch.cat([points_net(points), image_net(images)]))
        loss = chamfer(samples.reshape(len(samples), -1, 3), points) + 0.01 * stretch(samples, decoder.side)
        adam.zero_grad()
        loss.backward()
        adam.step()
    print(f"{name}: {steps * BATCH / (time.time() - started):.1f} images/s")


if __name__ == "__main__":
    main()
