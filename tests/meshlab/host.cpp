// SPDX-License-Identifier: GPL-3.0-or-later
// A MeshLab without a window, for 2022.02 and later, which have no meshlabserver: takes all plugins of a
// folder as the application does, and runs one filter with its defaults.
//   host PLUGINS FILTER IN OUT
// Prints the filter's values. Exit 1: with MeshLab's own text.
#include "common/mlexception.h"
#include "common/plugins/plugin_manager.h"
#include "common/globals.h"
#include "common/utilities/load_save.h"

#include <QApplication>
#include <QDir>

#include <cstdio>

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "host PLUGINS FILTER IN OUT\n");
    return 2;
  }
  QApplication app(argc, argv);
  PluginManager& plugins = meshlab::pluginManagerInstance();
  try {
    plugins.loadPlugins(QDir(argv[1]));
  } catch (const std::exception& error) {
    // Names every plugin that lacks a library of its own; the others are there.
    std::fprintf(stderr, "%s\n", error.what());
  }
  try {
    QAction* action = plugins.filterAction(argv[2]);
    FilterPlugin* filter = action ? plugins.getFilterPluginFromAction(action) : nullptr;
    if (!filter) {
      std::fprintf(stderr, "no plugin has the filter %s\n", argv[2]);
      return 1;
    }
    MeshDocument document;
    meshlab::loadMeshWithStandardParameters(argv[3], document);
    unsigned int changed = 0;
    const RichParameterList defaults = filter->initParameterList(action, document);
    for (const auto& [name, value] : filter->applyFilter(action, defaults, document, changed, nullptr))
      std::printf("%s: %s\n", name.c_str(), value.toString().toUtf8().constData());
    meshlab::saveMeshWithStandardParameters(argv[4], *document.mm());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
