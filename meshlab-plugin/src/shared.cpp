// SPDX-License-Identifier: GPL-3.0-or-later
#include "shared.h"

#include <cstdio>

std::string grouped(std::size_t n)
{
	std::string s = std::to_string(n);
	for (std::size_t i = s.size(); i > 3; i -= 3)
		s.insert(i - 3, ",");
	return s;
}

std::string brief(double x)
{
	char text[32];
	std::snprintf(text, sizeof text, "%.4g", x);
	return text;
}

MeshModel& current(MeshDocument& md)
{
	if (md.mm() == nullptr)
		throw std::runtime_error("atlasfit: there is no current layer. Open a scan or a mesh first");
	return *md.mm();
}

atlasfit_mesh mesh(const std::vector<double>& xyz, const std::vector<uint32_t>& corners)
{
	atlasfit_mesh in = defaults(atlasfit_mesh_init);
	in.positions = xyz.data();
	in.vertex_count = xyz.size() / 3;
	in.scalar = ATLASFIT_F64;
	in.triangles = corners.data();
	in.triangle_count = corners.size() / 3;
	return in;
}

atlasfit_points cloud(const std::vector<double>& xyz)
{
	atlasfit_points in = defaults(atlasfit_points_init);
	in.positions = xyz.data();
	in.count = xyz.size() / 3;
	in.scalar = ATLASFIT_F64;
	return in;
}

void keep_pages(
	MeshModel& layer, const MeshModel& beside, const std::vector<QImage>& images, Outcome& outcome)
{
	if (images.empty())
		return;
	for (const Page& p : set_pages(layer, beside, images))
		outcome.lines.push_back(p.kept ? "texture page: " + p.where : p.where);
}
