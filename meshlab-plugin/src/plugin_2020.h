// SPDX-License-Identifier: GPL-3.0-or-later
// The filters as a plugin of MeshLab 2020.09, which Debian 12 has.
#pragma once

#include "filters.h"

// Here too: moc does not follow host.h.
#include <common/interfaces.h>

class AtlasfitPlugin : public QObject, public MeshFilterInterface {
	Q_OBJECT
	MESHLAB_PLUGIN_IID_EXPORTER(MESH_FILTER_INTERFACE_IID)
	Q_INTERFACES(MeshFilterInterface)
public:
	AtlasfitPlugin();
	QString pluginName() const override { return "FilterAtlasfit"; }
	QString filterName(FilterIDType filter) const override { return about(filter).name; }
	QString filterInfo(FilterIDType filter) const override { return about(filter).help; }
	FilterClass getClass(QAction* a) override { return FilterClass(about(ID(a)).menus); }
	FILTER_ARITY filterArity(QAction*) const override { return SINGLE_MESH; }
	int getPreConditions(QAction* a) const override { return about(ID(a)).needs; }
	int postCondition(QAction* a) const override { return about(ID(a)).changes; }
	void initParameterSet(QAction*, MeshModel&, RichParameterList&) override;
	bool applyFilter(QAction*, MeshDocument&, const RichParameterList&, vcg::CallBackPos*) override;
};
