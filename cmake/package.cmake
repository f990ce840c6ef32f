# SPDX-License-Identifier: GPL-3.0-or-later
# `cmake --build build --target addon_zip` makes the zip that Blender installs: the add-on, the library, and every
# shared library that it needs, each found relative to the one that asks for it.
#
# Linux is what is built and tested. For Windows and macOS the steps are the same with another tool for the
# dependencies (dumpbin; otool and install_name_tool); cmake/package_addon.py says so instead of making half a zip.

find_package(Python3 QUIET COMPONENTS Interpreter)
find_program(EXM_PATCHELF patchelf)
find_program(EXM_STRIP NAMES ${CMAKE_STRIP} strip)
mark_as_advanced(EXM_PATCHELF EXM_STRIP)

if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  set(exm_architecture x64)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64|ARM64)$")
  set(exm_architecture arm64)
else()
  set(exm_architecture ${CMAKE_SYSTEM_PROCESSOR})
endif()
string(TOLOWER ${CMAKE_SYSTEM_NAME} exm_system)
# Blender's names of platforms: linux-x64, windows-x64, macos-arm64.
string(REPLACE darwin macos EXM_PLATFORM "${exm_system}-${exm_architecture}")

set(EXM_ADDON_ZIP ${PROJECT_BINARY_DIR}/exemplar-${PROJECT_VERSION}-${EXM_PLATFORM}.zip)

if(Python3_FOUND AND EXM_PATCHELF)
  add_custom_target(addon_zip
    COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/cmake/package_addon.py
      --source ${PROJECT_SOURCE_DIR} --library $<TARGET_FILE:exemplar> --version ${PROJECT_VERSION}
      --platform ${EXM_PLATFORM} --patchelf ${EXM_PATCHELF} --strip ${EXM_STRIP}
      --stage ${PROJECT_BINARY_DIR}/addon --output ${EXM_ADDON_ZIP}
    DEPENDS exemplar
    COMMENT "Packing ${EXM_ADDON_ZIP}"
    VERBATIM)
else()
  add_custom_target(addon_zip
    COMMAND ${CMAKE_COMMAND} -E echo "addon_zip needs python3 and patchelf; configure again when they are installed"
    COMMAND ${CMAKE_COMMAND} -E false)
endif()
