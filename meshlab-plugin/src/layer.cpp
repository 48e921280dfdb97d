// SPDX-License-Identifier: GPL-3.0-or-later
#include "layer.h"

#include <algorithm>
#include <cmath>
#include <numeric>

Frame::Frame(const CMeshO& layer)
{
	vcg::Matrix44d identity;
	identity.SetIdentity();
	to.Import(layer.Tr);
	back = identity;
	moved = !(to == identity);
	if (!moved)
		return;
	back = vcg::Inverse(to);
	const vcg::Matrix44d product = to * back;
	for (int i = 0; i < 16; ++i)
		if (!(std::abs(product[i / 4][i % 4] - identity[i / 4][i % 4]) < 1e-6))
			throw std::runtime_error("atlasfit: the layer's matrix flattens it, or is not finite. Use "
									 "\"Matrix: Reset Current Matrix\" first");
}

vcg::Point3<Coordinate> Frame::position_back(const double* p) const
{
	vcg::Point3d q(p[0], p[1], p[2]);
	if (moved)
		q = back * q;
	return vcg::Point3<Coordinate>::Construct(q);
}

vcg::Point3<Coordinate> Frame::normal_back(const float* n) const
{
	vcg::Point3d q(n[0], n[1], n[2]);
	if (moved) {
		// Normals go with the transposed inverse of what positions go with.
		q = vcg::Point3d(to[0][0] * n[0] + to[1][0] * n[1] + to[2][0] * n[2],
			to[0][1] * n[0] + to[1][1] * n[1] + to[2][1] * n[2],
			to[0][2] * n[0] + to[1][2] * n[1] + to[2][2] * n[2]);
		if (q.Norm() > 0)
			q.Normalize();
	}
	return vcg::Point3<Coordinate>::Construct(q);
}

Points points(const CMeshO& layer, const Frame& frame, bool only_selected)
{
	Points out;
	out.xyz.reserve(3 * std::size_t(layer.vn));
	out.vertex.reserve(std::size_t(layer.vn));
	for (std::size_t i = 0; i < layer.vert.size(); ++i) {
		const CVertexO& v = layer.vert[i];
		if (v.IsD() || (only_selected && !v.IsS()))
			continue;
		vcg::Point3d p = vcg::Point3d::Construct(v.cP());
		if (frame.moved)
			p = frame.to * p;
		out.xyz.insert(out.xyz.end(), {p[0], p[1], p[2]});
		out.vertex.push_back(uint32_t(i));
	}
	return out;
}

Triangles triangles(const CMeshO& layer, const Points& points)
{
	std::vector<uint32_t> place(layer.vert.size(), UINT32_MAX);
	for (std::size_t i = 0; i < points.vertex.size(); ++i)
		place[points.vertex[i]] = uint32_t(i);
	Triangles out;
	out.corners.reserve(3 * std::size_t(layer.fn));
	out.face.reserve(std::size_t(layer.fn));
	for (std::size_t i = 0; i < layer.face.size(); ++i) {
		const CFaceO& f = layer.face[i];
		if (f.IsD())
			continue;
		for (int k = 0; k < 3; ++k)
			out.corners.push_back(place[vcg::tri::Index(layer, f.cV(k))]);
		out.face.push_back(uint32_t(i));
	}
	return out;
}

std::vector<float> corner_uv(const CMeshO& layer, const Triangles& triangles)
{
	std::vector<float> uv;
	uv.reserve(6 * triangles.face.size());
	for (uint32_t face : triangles.face)
		for (int k = 0; k < 3; ++k) {
			const auto& corner = layer.face[face].cWT(k);
			uv.insert(uv.end(), {float(corner.U()), float(corner.V())});
		}
	return uv;
}

std::vector<uint32_t> face_pages(const CMeshO& layer, const Triangles& triangles)
{
	std::vector<uint32_t> pages;
	pages.reserve(triangles.face.size());
	for (uint32_t face : triangles.face)
		pages.push_back(uint32_t(std::max(0, int(layer.face[face].cWT(0).N()))));
	return pages;
}

std::vector<uint32_t> polygons(const CMeshO& layer, const Triangles& triangles)
{
	struct Hidden {
		uint32_t a, b, triangle;
		bool operator<(const Hidden& o) const
		{
			return std::tie(a, b, triangle) < std::tie(o.a, o.b, o.triangle);
		}
	};
	std::vector<Hidden> hidden;
	for (std::size_t i = 0; i < triangles.face.size(); ++i)
		for (int k = 0; k < 3; ++k)
			if (layer.face[triangles.face[i]].IsF(k)) {
				const uint32_t a = triangles.corners[3 * i + k], b = triangles.corners[3 * i + (k + 1) % 3];
				hidden.push_back({std::min(a, b), std::max(a, b), uint32_t(i)});
			}
	if (hidden.empty())
		return {};
	std::sort(hidden.begin(), hidden.end());
	std::vector<uint32_t> polygon(triangles.face.size());
	std::iota(polygon.begin(), polygon.end(), 0u);
	const auto root = [&](uint32_t i) {
		while (polygon[i] != i)
			i = polygon[i] = polygon[polygon[i]];
		return i;
	};
	for (std::size_t i = 0; i + 1 < hidden.size(); ++i)
		if (hidden[i].a == hidden[i + 1].a && hidden[i].b == hidden[i + 1].b) {
			const uint32_t p = root(hidden[i].triangle), q = root(hidden[i + 1].triangle);
			polygon[std::max(p, q)] = std::min(p, q);
		}
	for (uint32_t i = 0; i < polygon.size(); ++i)
		polygon[i] = root(i);
	return polygon;
}

std::vector<uint8_t> colors(const CMeshO& layer, const Points& points)
{
	std::vector<uint8_t> rgba;
	rgba.reserve(4 * points.vertex.size());
	for (uint32_t vertex : points.vertex) {
		const vcg::Color4b& c = layer.vert[vertex].cC();
		rgba.insert(rgba.end(), {c[0], c[1], c[2], c[3]});
	}
	return rgba;
}

bool are_painted(const std::vector<uint8_t>& rgba)
{
	for (std::size_t i = 4; i < rgba.size(); ++i)
		if (rgba[i] != rgba[i % 4])
			return true;
	return false;
}

void set_corner_uv(MeshModel& layer, const Triangles& triangles, const std::vector<float>& uv,
	const std::vector<uint32_t>& pages)
{
	layer.updateDataMask(MeshModel::MM_WEDGTEXCOORD);
	for (std::size_t i = 0; i < triangles.face.size(); ++i)
		for (int k = 0; k < 3; ++k) {
			auto& corner = layer.cm.face[triangles.face[i]].WT(k);
			corner.U() = uv[6 * i + 2 * std::size_t(k)];
			corner.V() = uv[6 * i + 2 * std::size_t(k) + 1];
			corner.N() = short(pages.empty() ? 0 : pages[i]);
		}
}
