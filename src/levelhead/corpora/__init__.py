"""One verb over many recordings, from a folder or an object store, on this machine or on a Dask cluster.

The room is called ``corpora`` because ``levelhead.corpus`` is the function.

    places      which recordings there are: folders, patterns, URLs
    job         the request, and its digest
    work        one recording: rows of results
    row_layout  the columns of these rows
    results     the folder of results: manifest, part files, finished rows
    plan        which recordings go together, and which wait for another's calibration
    cluster     who does the work: this process, local processes, a Dask cluster
    sensors     which recordings are of the same sensor, in order of time
    tune_corpus a filter's parameters over all of them
    runner      all of it together
    overview    tables of the rows: by group, the worst, the failures, the sensors over time
    html_report the same as an HTML page with pictures
"""
