// SPDX-License-Identifier: GPL-3.0-or-later
// What the filters share: texts for the log, the layer to work on, arrays for the library, pages.
#pragma once

#include "page.h"

#include <sstream>

/// "12,345": readable in a log.
std::string grouped(std::size_t n);
std::string brief(double x);

/// The layer that the filter works on.
MeshModel& current(MeshDocument& md);

/// A mesh for the library, and points; they borrow the arrays.
atlasfit_mesh mesh(const std::vector<double>& xyz, const std::vector<uint32_t>& corners);
atlasfit_points cloud(const std::vector<double>& xyz);

/// Gives the layer its pages and says where they are.
void keep_pages(
	MeshModel& layer, const MeshModel& beside, const std::vector<QImage>& images, Outcome& outcome);

/// The library's warnings, a line each. `get` is atlasfit_result_warnings or atlasfit_uv_warnings.
template <class Handle, class Get> void warn(const Handle* handle, Get get, Outcome& outcome)
{
	std::size_t length = 0;
	check(get(handle, nullptr, 0, &length));
	std::vector<char> text(length + 1);
	check(get(handle, text.data(), text.size(), &length));
	std::istringstream lines(text.data());
	for (std::string line; std::getline(lines, line);)
		outcome.lines.push_back("warning: " + line);
}

// The filters. A failure is a std::exception whose text is for the user.
void reconstruct(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome);
void denoise_vertices(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome);
void parametrize(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome);
void pack(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome);
void distortion(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome);
