# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the zip that Blender installs. Called by the CMake target addon_zip; needs patchelf.

Layout: one folder `exemplar/` with everything in it. Blender 3.4 installs an add-on from a folder
in a zip under that folder's name; Blender 4.2 and later accept an extension in one folder as well
as at the root.

What is bundled, in native/lib/ beside libexemplar.so: every shared library it needs, directly or
not, but those of the system below.

- The C library and the loader must be the system's; nothing else works.
- libstdc++ and libgcc_s are left to the system on purpose: graphics drivers load them too, and an
  older copy of ours, loaded first under the same name, would keep a newer driver from loading. What
  we need of them (GCC 11) is older than the C library we need (2.35), so it is always there.

Each bundled library gets a name of its own (libmetis-exemplar.so.5): the loader takes a library it
already has under the same name, and another add-on's may be older, or built otherwise. OpenBLAS
holds BLAS and LAPACK as well, so whatever asks for libblas or liblapack is pointed to it, and the
two are left out.
"""

import argparse
import re
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

FOLDER = "exemplar"

SYSTEM_LIBRARIES = re.compile(
    r"^(ld-linux.*|linux-vdso|libc|libm|libdl|libpthread|librt|libstdc\+\+|libgcc_s)\.so(\.|$)"
)

# Kept out of the zip: what Python leaves behind, and the library of somebody's build.
IGNORED = shutil.ignore_patterns("__pycache__", "*.pyc", "lib", ".*")

# 1980 is where zip's calendar begins.
TIMESTAMP = (1980, 1, 1, 0, 0, 0)

COMMON_LICENCES = Path("/usr/share/common-licenses")


def run(*command):
    """Standard output of a tool; what it says on failure is our failure."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))} failed:\n{done.stderr or done.stdout}")
    return done.stdout


# -------------------------------------------------------------------------------------- libraries


def needed(library):
    """The names it asks for, and the search path that is written into it."""
    text = run("readelf", "--dynamic", "--wide", library)
    names = re.findall(r"\(NEEDED\).*\[(.*)\]", text)
    paths = re.findall(r"\((?:RUNPATH|RPATH)\).*\[(.*)\]", text)
    return names, paths


def resolve(library):
    """{name: file} of all that the loader would load with it on this machine."""
    found = {}
    for line in run("ldd", library).splitlines():
        match = re.match(r"\s*(\S+) => (.*?)(?: \(0x[0-9a-f]+\))?$", line)
        if match and match[2] == "not found":
            sys.exit(f"{library} needs {match[1]}, which is not on this machine")
        if match:
            found[match[1]] = Path(match[2]).resolve()
    return found


def own_name(name):
    """libmetis.so.5 -> libmetis-exemplar.so.5"""
    return name.replace(".so", "-exemplar.so", 1)


def aliases(found):
    """{name: name} of the libraries that another one of them replaces."""
    openblas = next((name for name in found if name.startswith("libopenblas.so")), None)
    if openblas is None:
        return {}
    return {name: openblas for name in found if re.match(r"lib(blas|lapack)\.so", name)}


def bundle(library, folder, arguments):
    """Copy the library and what it needs into `folder`, made to find each other. Returns their
    originals."""
    found = resolve(library)
    replaced = aliases(found)
    waiting, done = [("libexemplar.so", library)], {}
    while waiting:
        target, origin = waiting.pop()
        if target in done:
            continue
        done[target] = origin
        copy = folder / target
        shutil.copyfile(origin, copy)
        copy.chmod(0o755)
        run(arguments.strip, "--strip-unneeded", copy)
        asked = [name for name in needed(copy)[0] if not SYSTEM_LIBRARIES.match(name)]
        waiting += [(own_name(replaced.get(n, n)), found[replaced.get(n, n)]) for n in asked]
        rename(copy, asked, replaced, arguments.patchelf)
    return done


def rename(library, asked, replaced, patchelf):
    """Give the library its own name, and the names that it asks for.

    One run an edit: patchelf 0.14 mixes up the strings of several edits in one run.
    """
    run(patchelf, "--set-soname", library.name, library)
    present = set()
    for name in asked:
        real = own_name(replaced.get(name, name))
        if real in present:
            run(patchelf, "--remove-needed", name, library)
        else:
            run(patchelf, "--replace-needed", name, real, library)
        present.add(real)
    run(patchelf, "--set-rpath", "$ORIGIN", library)


def check_bundle(folder, source):
    """Nothing of the build machine is left, and nothing is missing."""
    libraries = sorted(folder.iterdir())
    present = {library.name for library in libraries}
    for library in libraries:
        names, paths = needed(library)
        soname = re.findall(r"\(SONAME\).*\[(.*)\]", run("readelf", "--dynamic", "--wide", library))
        if soname != [library.name]:
            sys.exit(f"{library.name} calls itself {soname}")
        if paths != ["$ORIGIN"]:
            sys.exit(f"{library.name} searches {paths}, not only beside itself")
        strange = [n for n in names if n not in present and not SYSTEM_LIBRARIES.match(n)]
        if strange:
            sys.exit(f"{library.name} needs {strange}, which are neither bundled nor the system's")
    ours = folder / "libexemplar.so"
    if str(source).encode() in ours.read_bytes():
        sys.exit(f"{ours.name} has the path of the source tree in it")
    unresolved = re.findall(r"undefined symbol: .*", run("ldd", "-r", ours))
    if unresolved:
        sys.exit("Unresolved in the bundle:\n" + "\n".join(unresolved))


# ---------------------------------------------------------------------------------------- notices


def package_of(library):
    """(package, version, copyright file) of a library of this Debian system."""
    for path in (library, Path(str(library).removeprefix("/usr"))):
        done = subprocess.run(["dpkg", "-S", str(path)], capture_output=True, text=True)
        if done.returncode == 0:
            package = done.stdout.split(":")[0].split(",")[0].strip()
            version = run("dpkg-query", "-W", "-f=${Version}\n", package).splitlines()[0]
            notice = Path("/usr/share/doc") / package / "copyright"
            if not notice.is_file():
                sys.exit(f"{notice}, the licence of {library.name}, is not on this machine")
            return package, version, notice
    sys.exit(f"{library} belongs to no package, so its licence is not known")


def write_notices(bundled, stage):
    """THIRD_PARTY.md, and in licences/ the texts as the packages carry them."""
    folder = stage / "licences"
    folder.mkdir()
    rows, common = [], set()
    for name, origin in sorted(bundled.items()):
        if name == "libexemplar.so":
            continue
        package, version, notice = package_of(origin)
        text = notice.read_text(encoding="utf-8", errors="replace")
        (folder / f"{package}.txt").write_text(text, encoding="utf-8")
        common |= set(re.findall(r"/usr/share/common-licenses/([A-Za-z]+-?[0-9.]*[0-9])", text))
        rows.append(f"| `{name}` | {package} | {version} | [text](licences/{package}.txt) |")
    for licence in sorted(common):
        if (COMMON_LICENCES / licence).is_file():
            shutil.copyfile(COMMON_LICENCES / licence, folder / f"{licence}.txt")
    lines = [
        "# Third-party libraries in this package",
        "",
        "Exemplar itself is under the GPL, version 3 or later (`LICENSE`). The libraries below lie",
        "in `native/lib/`, built by Debian from the sources of the packages named here",
        "(`https://snapshot.debian.org`), with nothing changed but their file names and where they",
        "look for each other. Texts that a licence refers to are in `licences/` as well.",
        "",
        "| file | package | version | licence |",
        "|---|---|---|---|",
        *rows,
        "",
    ]
    (stage / "THIRD_PARTY.md").write_text("\n".join(lines), encoding="utf-8")


# ------------------------------------------------------------------------------------------ files


def substitute(path, pattern, replacement):
    text = path.read_text(encoding="utf-8")
    changed, count = re.subn(pattern, replacement, text, count=1, flags=re.MULTILINE)
    if count != 1:
        sys.exit(f"{path} does not state what the package has to set: {pattern}")
    path.write_text(changed, encoding="utf-8")


def stamp(stage, version, platform):
    """The version and platform of this build, in the two places where Blender looks."""
    manifest = stage / "blender_manifest.toml"
    substitute(manifest, r'^version = ".*"', f'version = "{version}"')
    if re.search(r"^platforms\s*=", manifest.read_text(encoding="utf-8"), re.MULTILINE):
        substitute(manifest, r"^platforms\s*=.*", f'platforms = ["{platform}"]')
    else:
        substitute(manifest, r'^(version = ".*")', f'\\1\nplatforms = ["{platform}"]')
    numbers = ", ".join(version.split("."))
    substitute(stage / "__init__.py", r'"version": \([0-9, ]+\)', f'"version": ({numbers})')


def write_zip(stage, output):
    """The same bytes for the same files: sorted, one timestamp, fixed permissions."""
    partial = output.with_suffix(".part")
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for path in sorted(p for p in stage.rglob("*") if p.is_file()):
            entry = zipfile.ZipInfo(f"{FOLDER}/{path.relative_to(stage).as_posix()}", TIMESTAMP)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix, wherever it is made: permissions count
            entry.external_attr = (0o100755 if ".so" in path.name else 0o100644) << 16
            archive.writestr(entry, path.read_bytes())
    partial.replace(output)


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--source", type=Path, required=True, help="root of the source tree")
    parser.add_argument("--library", type=Path, required=True, help="the built libexemplar.so")
    parser.add_argument("--version", required=True)
    parser.add_argument("--platform", required=True, help="as Blender calls it: linux-x64")
    parser.add_argument("--stage", type=Path, required=True, help="folder to build in; emptied")
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--patchelf", default="patchelf")
    parser.add_argument("--strip", default="strip")
    return parser.parse_args()


def main():
    arguments = parse_arguments()
    if not arguments.platform.startswith("linux-"):
        sys.exit("Bundling libraries is written and tested for Linux only; see the file's head")
    began = time.monotonic()
    stage = arguments.stage / FOLDER
    shutil.rmtree(arguments.stage, ignore_errors=True)
    shutil.copytree(arguments.source / "blender_addon", stage, ignore=IGNORED)
    libraries = stage / "native" / "lib"
    libraries.mkdir(parents=True)
    shutil.copyfile(arguments.source / "LICENSE", stage / "LICENSE")
    stamp(stage, arguments.version, arguments.platform)
    bundled = bundle(arguments.library.resolve(), libraries, arguments)
    check_bundle(libraries, arguments.source)
    write_notices(bundled, stage)
    write_zip(stage, arguments.output)
    unpacked = sum(path.stat().st_size for path in stage.rglob("*") if path.is_file())
    print(
        f"{arguments.output}: {arguments.output.stat().st_size / 1e6:.1f} MB, "
        f"{unpacked / 1e6:.1f} MB unpacked, in {time.monotonic() - began:.1f} s"
    )


if __name__ == "__main__":
    main()
