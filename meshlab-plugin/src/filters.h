// SPDX-License-Identifier: GPL-3.0-or-later
// The filters as every MeshLab sees them: names, help, parameters (about.cpp), and applying one to the
// current layer (filters.cpp, by scan_filters.cpp and uv_filters.cpp). No algorithm: arrays out, one call
// into libatlasfit, arrays back.
#pragma once

#include "host.h"

/// The filters, by the number that the host knows them by.
enum Filter { RECONSTRUCT, DENOISE, PARAMETRIZE, PACK, DISTORTION, FILTERS };

/// Choices of the parameter "texture". Colours are those of the textures that a layer has, else of its
/// vertices, else there is no page.
enum Texture { TEXTURE_COLORS, TEXTURE_CHECKER, TEXTURE_NONE };

/// What the host shows of a filter, and what it must know before and after it runs.
struct About {
	QString name;
	/// Its name in pymeshlab.
	QString python_name;
	/// Help, in the host's simple HTML.
	QString help;
	/// Menus: Host::FilterClass values, joined.
	int menus;
	/// What the layer must have: MeshModel::MeshElement values, joined.
	int needs;
	/// What is changed: MeshModel::MeshElement values, joined. The host previews filters that change no
	/// number of vertices or faces.
	int changes;
};

/// One parameter of a filter.
struct Parameter {
	/// LENGTH is a number that the host shows as a share of the layer's diagonal too.
	enum Kind { BOOL, INT, FLOAT, LENGTH, ENUM };
	Kind kind;
	QString name;
	double value;
	QString label;
	QString help;
	QStringList choices;
	/// Shown behind "advanced"; not at all where the host has no such place.
	bool advanced;
};

/// What a filter has to say after it succeeded.
struct Outcome {
	std::vector<std::string> lines;
	/// Named numbers; pymeshlab gives them to the script.
	std::vector<std::pair<std::string, double>> values;
	/// Seconds spent in libatlasfit.
	double library_seconds = 0;
};

const About& about(int filter);
std::vector<Parameter> parameters(int filter);

/// Applies a filter to the current layer. A failure is a std::exception whose text is for the user, and
/// leaves the document as it was.
Outcome apply(int filter, const RichParameterList& par, MeshDocument& md, vcg::CallBackPos* progress);
