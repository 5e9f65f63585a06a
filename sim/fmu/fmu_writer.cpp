#include "fmu_writer.hpp"

#include <zip.h>

#include <cctype>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <numbers>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "fmu_library.hpp"
#include "fmu_variables.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

namespace fs = std::filesystem;

std::string xml_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

/// A name that is one in C, as the library of the FMU needs.
std::string identifier_of(const std::string& name) {
  std::string identifier;
  for (const char c : name) identifier += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return identifier.empty() || std::isdigit(static_cast<unsigned char>(identifier.front())) != 0
             ? "_" + identifier
             : identifier;
}

/// The same for the same content: FNV-1a with two offsets.
std::string guid_of(const std::string& content) {
  std::string guid = "{";
  for (const std::uint64_t offset : {0xcbf29ce484222325u, 0x84222325cbf29ce4u}) {
    std::uint64_t hash = offset;
    for (const char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    char text[20];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
    guid += text;
  }
  return guid + "}";
}

std::string variable_xml(const FmuVariable& variable, FmuPlant& plant) {
  std::string xml = "    <ScalarVariable name=\"" + xml_escaped(variable.name) + "\" valueReference=\"" +
                    std::to_string(variable.reference) + "\" description=\"" +
                    xml_escaped(variable.description) + "\" ";
  std::string start;
  switch (variable.causality) {
    case FmuCausality::input:
      xml += "causality=\"input\" variability=\"continuous\"";
      start = " start=\"0\"";
      break;
    case FmuCausality::output:
      xml += "causality=\"output\" variability=\"continuous\" initial=\"calculated\"";
      break;
    case FmuCausality::parameter:
      xml += "causality=\"parameter\" variability=\"fixed\" initial=\"exact\"";
      start = " start=\"" + exact_text(*fmu_parameter(plant, variable.reference)) + "\"";
      break;
  }
  return xml + "><Real unit=\"" + xml_escaped(variable.unit) + "\"" + start + "/></ScalarVariable>\n";
}

std::string model_description(const std::string& name, const std::string& guid, FmuPlant plant) {
  const std::vector<FmuVariable> variables = fmu_variables(plant.plant);
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\" modelName=\"" +
      xml_escaped(name) + "\" guid=\"" + guid +
      "\" generationTool=\"upright\" variableNamingConvention=\"flat\">\n" +
      "  <CoSimulation modelIdentifier=\"" + identifier_of(name) +
      "\" canHandleVariableCommunicationStepSize=\"true\" canGetAndSetFMUstate=\"true\"/>\n  "
      "<UnitDefinitions>\n";
  std::set<std::string> units;
  for (const FmuVariable& variable : variables) units.insert(variable.unit);
  for (const std::string& unit : units) xml += "    <Unit name=\"" + xml_escaped(unit) + "\"/>\n";
  xml +=
      "  </UnitDefinitions>\n  <LogCategories><Category name=\"logStatusError\"/></LogCategories>\n"
      "  <DefaultExperiment startTime=\"0\" stopTime=\"10\" stepSize=\"0.001\"/>\n  <ModelVariables>\n";
  std::string outputs;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    xml += variable_xml(variables[i], plant);
    if (variables[i].causality == FmuCausality::output)
      outputs += "      <Unknown index=\"" + std::to_string(i + 1) + "\"/>\n";
  }
  return xml + "  </ModelVariables>\n  <ModelStructure>\n    <Outputs>\n" + outputs + "    </Outputs>\n" +
         "    <InitialUnknowns>\n" + outputs + "    </InitialUnknowns>\n  </ModelStructure>\n" +
         "</fmiModelDescription>\n";
}

/// A zip archive that is whole or not there.
void write_zip(const fs::path& file, const std::vector<std::pair<std::string, std::string_view>>& members) {
  const auto refuse = [&](const char* why) {
    throw ConfigError("cannot write " + file.string() + " (" + why +
                      "): check the folder and its free space");
  };
  int problem = 0;
  zip_t* archive = zip_open(file.c_str(), ZIP_CREATE | ZIP_EXCL, &problem);
  if (archive == nullptr) refuse("it cannot be created");
  for (const auto& [name, content] : members) {
    zip_source_t* source = zip_source_buffer(archive, content.data(), content.size(), 0);
    if (source != nullptr && zip_file_add(archive, name.c_str(), source, ZIP_FL_ENC_UTF_8) >= 0) continue;
    if (source != nullptr) zip_source_free(source);
    zip_discard(archive);
    refuse("a part of it cannot be added");
  }
  if (zip_close(archive) == 0) return;
  zip_discard(archive);
  refuse("it cannot be completed");
}

}  // namespace

void write_fmu(const Plant& plant, const std::string& name, const fs::path& file) {
  FmuPlant model{plant};
  if (plant.pendulum) model.theta_rad = std::numbers::pi;
  const std::string text = fmu_plant_text(model);
  const std::string guid = guid_of(name + "\n" + text);
  const std::string resource = guid + "\n" + text, description = model_description(name, guid, model);
  write_zip(file, {{"modelDescription.xml", description},
                   {"binaries/linux64/" + identifier_of(name) + ".so", fmu_library()},
                   {"resources/plant.txt", resource}});
}

}  // namespace upright
