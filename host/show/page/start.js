/* SPDX-License-Identifier: GPL-3.0-or-later */
/* start.js - shows the curves that stand in the page. */
'use strict';

Explore.show(document.getElementById('explore'), JSON.parse(document.getElementById('curves').textContent));
