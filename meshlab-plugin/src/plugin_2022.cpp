// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin_2022.h"

#include <cmath>

AtlasfitPlugin::AtlasfitPlugin()
{
	for (int filter = 0; filter < FILTERS; ++filter) {
		typeList.push_back(filter);
		actionList.push_back(new QAction(filterName(filter), this));
	}
}

RichParameterList AtlasfitPlugin::initParameterList(const QAction* a, const MeshModel& layer)
{
	RichParameterList list;
	for (const Parameter& p : parameters(ID(a))) {
		switch (p.kind) {
		case Parameter::BOOL:
			list.addParam(RichBool(p.name, p.value != 0, p.label, p.help, p.advanced));
			break;
		case Parameter::INT: list.addParam(RichInt(p.name, int(p.value), p.label, p.help, p.advanced)); break;
		case Parameter::FLOAT:
			list.addParam(RichFloat(p.name, Scalarm(p.value), p.label, p.help, p.advanced));
			break;
		case Parameter::LENGTH:
			list.addParam(RichLength(
				p.name, Scalarm(p.value), 0, Scalarm(diagonal(layer)), p.label, p.help, p.advanced));
			break;
		case Parameter::ENUM:
			list.addParam(RichEnum(p.name, int(p.value), p.choices, p.label, p.help, p.advanced));
			break;
		}
	}
	return list;
}

std::map<std::string, QVariant> AtlasfitPlugin::applyFilter(const QAction* a, const RichParameterList& par,
	MeshDocument& md, unsigned int&, vcg::CallBackPos* progress)
{
	Outcome outcome;
	try {
		outcome = apply(ID(a), par, md, progress);
	} catch (const std::exception& e) {
		throw MLException(QString::fromUtf8(e.what()));
	}
	for (const std::string& line : outcome.lines)
		log("%s", line.c_str());
	std::map<std::string, QVariant> values;
	for (const auto& [name, value] : outcome.values) {
		const bool whole = value == std::floor(value) && std::abs(value) < 2e9;
		values[name] = whole ? QVariant(int(value)) : QVariant(value);
	}
	return values;
}

MESHLAB_PLUGIN_NAME_EXPORTER(AtlasfitPlugin)
