// SPDX-License-Identifier: GPL-3.0-or-later
// The filters as a plugin of MeshLab 2022.02 and 2025.07 (one interface).
#pragma once

#include "filters.h"

// Here too: moc does not follow host.h.
#include <common/plugins/interfaces/filter_plugin.h>

class AtlasfitPlugin : public QObject, public FilterPlugin {
	Q_OBJECT
	MESHLAB_PLUGIN_IID_EXPORTER(FILTER_PLUGIN_IID)
	Q_INTERFACES(FilterPlugin)
public:
	AtlasfitPlugin();
	QString pluginName() const override { return "FilterAtlasfit"; }
	QString vendor() const override { return "atlasfit"; }
	QString filterName(ActionIDType filter) const override { return about(filter).name; }
	QString pythonFilterName(ActionIDType filter) const override { return about(filter).python_name; }
	QString filterInfo(ActionIDType filter) const override { return about(filter).help; }
	FilterClass getClass(const QAction* a) const override { return FilterClass(about(ID(a)).menus); }
	FilterArity filterArity(const QAction*) const override { return SINGLE_MESH; }
	int getPreConditions(const QAction* a) const override { return about(ID(a)).needs; }
	int postCondition(const QAction* a) const override { return about(ID(a)).changes; }
	RichParameterList initParameterList(const QAction*, const MeshModel&) override;
	std::map<std::string, QVariant> applyFilter(const QAction*, const RichParameterList&, MeshDocument&,
		unsigned int& postConditionMask, vcg::CallBackPos*) override;
};
