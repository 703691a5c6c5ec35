// SPDX-License-Identifier: Apache-2.0
// The reader of each table of the scene file. Private: readScene() calls them, and each is in the
// read_*.cpp of its name.
//
// Each takes a reader of its table, reads every key, and calls finish(), so that a key that it does
// not know is an Error. All throw Error with the file, the line and the value. On a reader made by
// TableReader::describing() they list their keys and return a value that nobody uses.
#pragma once

#include <string>
#include <vector>

#include "volcomp/compose/compose_params.h"
#include "volcomp/grow/growth_rule.h"
#include "volcomp/place/layer.h"
#include "volcomp/render/render_params.h"
#include "volcomp/scene/known.h"
#include "volcomp/scene/toml_reader.h"
#include "volcomp/surface/second_density.h"
#include "volcomp/surface/surface.h"
#include "volcomp/view/camera.h"
#include "volcomp/view/dome.h"
#include "volcomp/view/haze.h"
#include "volcomp/view/light.h"
#include "volcomp/view/tone.h"
#include "volcomp/volume/material.h"

namespace volcomp {

Material readMaterial(TableReader& table, const std::string& name); ///< [material.NAME]
Camera readCamera(TableReader& table);                              ///< [camera]
ComposeParams readCompose(TableReader& table);                      ///< [compose]
RenderParams readRender(TableReader& table);                        ///< [render]
Dome readDome(TableReader& table);                                  ///< [dome]
Haze readHaze(TableReader& table);                                  ///< [haze]
Look readLook(TableReader& table);                                  ///< [picture]

/// The [preset.NAME] tables, which levels may use.
using Presets = std::vector<std::pair<std::string, const TableReader*>>;

/// Reads a [box.NAME] table with its levels. `materials` and `presets` are those that its keys may
/// name. Appends to `warnings` what may be a mistake.
GrowthRule readGrowthRule(TableReader& table, const std::string& name,
                          const Known<Material>& materials, const Presets& presets,
                          std::vector<std::string>& warnings);

/// Reads a [groom.NAME] table: a rule whose variants are the groom's pieces.
GrowthRule readGroom(TableReader& table, const std::string& name, const Known<Material>& materials);

/// Reads the unit and the up axis of a file of strands or triangles.
FileAxes readFileAxes(TableReader& table);

/// Reads the other keys of strands of a file that boxes and grooms have in common.
void readCurvesKeys(TableReader& table, CurvesSpec& curves);

/// Reads the keys of a [box.NAME] table about a mesh, behind `mesh` itself and its axes, and its
/// tables mesh_material, into rule.mesh. `rule.material` is that of triangles that none of them
/// means.
void readMeshBox(TableReader& table, GrowthRule& rule, const Known<Material>& materials);

/// Throws the Error that points at the key if there is no material of that name.
void requireMaterial(const TableReader& r, const Known<Material>& materials,
                     const std::string& name);

/// Reads a [surface.NAME] table. It does not check that the skin's material exists. Appends to
/// `warnings` what may be a mistake.
SurfaceSpec readSurface(TableReader& table, const std::string& name,
                        std::vector<std::string>& warnings);

/// Reads a [[layer]] or [[light]] table, the one with number `index` (from 0) of the file. If the
/// table gives no name, the name is the word and the number from 1.
Layer readLayer(TableReader& table, int index);
Light readLight(TableReader& table, int index);
/// Reads a [[place]] table, as a layer of one place.
Layer readPlace(TableReader& table, int index);

/// Reads the array of tables `name` inside `table`; returns no factors if it is absent. If `colour`
/// is true, the constant is a colour, otherwise a number.
std::vector<MapFactor> readMaps(TableReader& table, const char* name, const char* meaning,
                                bool colour);

} // namespace volcomp
