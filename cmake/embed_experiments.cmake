# Writes the experiment files of a folder as C++ text, so that the program carries them wherever it is run from.
# Arguments: FOLDER (under the source folder), SOURCE, OUTPUT.
file(GLOB files ${SOURCE}/${FOLDER}/*.yaml)
list(SORT files)
set(text "// The files of ${FOLDER}, written by the build.\n")
foreach(file IN LISTS files)
  get_filename_component(name ${file} NAME)
  file(READ ${file} content)
  # What is printed elsewhere is not beside the schema.
  string(REGEX REPLACE "^# yaml-language-server:[^\n]*\n" "" content "${content}")
  string(APPEND text "{\"${FOLDER}/${name}\",\nR\"yaml(${content})yaml\"},\n")
endforeach()
file(WRITE ${OUTPUT}.new "${text}")
file(COPY_FILE ${OUTPUT}.new ${OUTPUT} ONLY_IF_DIFFERENT)
