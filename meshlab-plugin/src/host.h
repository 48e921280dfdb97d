// SPDX-License-Identifier: GPL-3.0-or-later
// What differs between MeshLab 2020.09 and 2022.02 onwards for code that works on layers. The filters are
// written against this file once.
#pragma once

#if __has_include(<common/plugins/interfaces/filter_plugin.h>)
#include <common/plugins/interfaces/filter_plugin.h>
#define ATLASFIT_MESHLAB_2020 0
using Host = FilterPlugin;
#else
#include <common/interfaces.h>
#define ATLASFIT_MESHLAB_2020 1
using Host = MeshFilterInterface;
#endif

#include <QDir>
#include <QFileInfo>
#include <QImage>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

/// The type of the host's coordinates: float or double, as it was built.
using Coordinate = CMeshO::ScalarType;

/// Whether the host's numbers are double.
constexpr bool DOUBLE_HOST = std::is_same<Coordinate, double>::value;

/// Whether the host knows texture pages as files only.
constexpr bool PAGES_ARE_FILES = ATLASFIT_MESHLAB_2020 != 0;

/// Bounding box, and from the faces (where there are any) face and vertex normals.
inline void update_box_and_normals(MeshModel& layer)
{
#if ATLASFIT_MESHLAB_2020
	layer.UpdateBoxAndNormals();
#else
	layer.updateBoxAndNormals();
#endif
}

/// The host's number that is shown as a share of the diagonal too.
#if !ATLASFIT_MESHLAB_2020 && __has_include(<common/parameters/rich_parameter/rich_percentage.h>)
using RichLength = RichPercentage;
#else
using RichLength = RichAbsPerc;
#endif

/// The diagonal of a layer as it is shown; 1 of an empty one.
inline double diagonal(const MeshModel& layer)
{
	const double length = double(layer.cm.trBB().Diag());
	return layer.cm.vn > 0 && length > 0 ? length : 1;
}

/// A texture page of a layer; null where its file cannot be read.
inline QImage page_of(const MeshModel& layer, const std::string& name)
{
#if ATLASFIT_MESHLAB_2020
	const QString file = QString::fromStdString(name);
	const QImage here(file);
	return here.isNull() ? QImage(QFileInfo(layer.fullName()).absoluteDir().absoluteFilePath(file)) : here;
#else
	return layer.getTexture(name);
#endif
}

/// Where a page of a layer is kept from now on, or why it is not kept (`kept` is false).
struct Page {
	bool kept;
	std::string where;
};

/// Makes `images` the layer's texture pages, in order, in place of those it had. `beside` is the layer whose
/// name and folder the pages take.
///
/// From 2022.02 pages are held in memory until the layer is saved. 2020.09 knows files only: pages are
/// written beside the layer's file, under a name that is free.
inline std::vector<Page> set_pages(
	MeshModel& layer, const MeshModel& beside, const std::vector<QImage>& images)
{
	QString stem = QFileInfo(beside.label()).completeBaseName();
	stem.replace(' ', '_'); // which not every reader of .mtl files takes
	if (!stem.endsWith("_atlas"))
		stem += "_atlas";
	std::vector<Page> pages;
#if ATLASFIT_MESHLAB_2020
	const QDir folder =
		beside.fullName().isEmpty() ? QDir::current() : QFileInfo(beside.fullName()).absoluteDir();
	layer.cm.textures.clear();
	for (const QImage& image : images) {
		QString name;
		for (int n = 0; name.isEmpty() || folder.exists(name); ++n)
			name = n == 0 ? stem + ".png" : QString("%1_%2.png").arg(stem).arg(n);
		const QString path = folder.absoluteFilePath(name);
		if (!image.save(path)) {
			layer.cm.textures.clear();
			return {{false,
				"the texture page cannot be written to " + path.toStdString() +
					". Save the layer where files may be written"}};
		}
		// The host looks for names from the current folder, which is that of the file opened last.
		layer.cm.textures.push_back((folder == QDir::current() ? name : path).toStdString());
		pages.push_back({true, path.toStdString()});
	}
#else
	layer.clearTextures();
	for (std::size_t i = 0; i < images.size(); ++i) {
		const std::string name =
			(images.size() == 1 ? stem + ".png" : QString("%1_%2.png").arg(stem).arg(i)).toStdString();
		layer.addTexture(name, images[i]);
		pages.push_back({true, name});
	}
#endif
	return pages;
}
