# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Settings of the site: python -m sphinx -W --keep-going docs build/docs."""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

project = 'kinematics_service'
author = 'kinematics_service maintainers'
release = ElementTree.parse(HERE.parent / 'package.xml').getroot().findtext('version')
version = release

extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon', 'from_code']
myst_enable_extensions = ['colon_fence', 'deflist']
myst_heading_anchors = 3

# A link of a page to a page or a heading that is not there is a warning, which -W makes an error.
nitpicky = True
# Signatures name types of numpy and of modules that are not part of the API.
nitpick_ignore_regex = [('py:.*', '.*')]
autodoc_member_order = 'bysource'
autodoc_typehints = 'none'  # shapes and units stand in the docstrings
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = 'furo'
html_title = f'kinematics_service {release}'
html_theme_options = {'navigation_with_keys': True}
# Seen on a light page and on a dark one.
html_logo = html_favicon = 'logo.svg'
html_show_copyright = False
html_static_path = ['site.css', 'front/arms.js', 'front/live.js']
html_css_files = ['site.css']
