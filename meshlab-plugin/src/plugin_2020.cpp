// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin_2020.h"

AtlasfitPlugin::AtlasfitPlugin()
{
	for (int filter = 0; filter < FILTERS; ++filter) {
		typeList << filter;
		actionList << new QAction(filterName(filter), this);
	}
}

static void add(RichParameterList& list, const Parameter& p, const MeshModel& layer)
{
	switch (p.kind) {
	case Parameter::BOOL: list.addParam(RichBool(p.name, p.value != 0, p.label, p.help)); break;
	case Parameter::INT: list.addParam(RichInt(p.name, int(p.value), p.label, p.help)); break;
	case Parameter::FLOAT: list.addParam(RichFloat(p.name, float(p.value), p.label, p.help)); break;
	case Parameter::LENGTH:
		list.addParam(RichLength(p.name, float(p.value), 0, float(diagonal(layer)), p.label, p.help));
		break;
	case Parameter::ENUM: list.addParam(RichEnum(p.name, int(p.value), p.choices, p.label, p.help)); break;
	}
}

void AtlasfitPlugin::initParameterSet(QAction* a, MeshModel& layer, RichParameterList& list)
{
	for (const Parameter& p : parameters(ID(a)))
		if (!p.advanced)
			add(list, p, layer);
}

bool AtlasfitPlugin::applyFilter(
	QAction* a, MeshDocument& md, const RichParameterList& par, vcg::CallBackPos* progress)
{
	try {
		// What is not shown has its default, unless a script gives it.
		RichParameterList all = par;
		for (const Parameter& p : parameters(ID(a)))
			if (md.mm() != nullptr && !all.hasParameter(p.name))
				add(all, p, *md.mm());
		for (const std::string& line : apply(ID(a), all, md, progress).lines)
			Log("%s", line.c_str());
	} catch (const std::exception& e) {
		errorMessage = QString::fromUtf8(e.what());
		// meshlabserver shows the filter's name only, but prints its log.
		Log("%s", e.what());
		return false;
	}
	return true;
}

MESHLAB_PLUGIN_NAME_EXPORTER(AtlasfitPlugin)
