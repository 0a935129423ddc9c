"""The words of logs: the names that columns have, in small letters and digits only, as names are compared."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping

from ftproc.records import COMPONENTS

#: What a log is made of, in the order of its canonical columns.
QUANTITIES = ("time", *COMPONENTS)


def _split(words: str) -> tuple[str, ...]:
    return tuple(words.split())


#: Names of each quantity, the full name first.
ALIASES: Mapping[str, tuple[str, ...]] = {
    "time": _split(
        """
        time t timestamp datetime utc ut gps tod sod tow sow epoch irig irigb jd mjd seconds secs sec elapsed
        elapsedtime elapsedseconds timeofday secondsofday secofday secsofday timeofweek secondsofweek gpstime
        gpstow gpstimeofweek gpsseconds utctime timeutc timegps utctimestamp utcdatetime datetimeutc dateandtime unix
        unixtime posix posixtime timesinceepoch secondssinceepoch juliandate julianday
        modifiedjuliandate datenum stamp zulu utcsec irigtime sampletime timetag clock
        timeepoch epochtime zeitpunkt systime itow utcsod utctod utcseconds timestamputc unixtimestamp excel
        exceldate exceltime excelserial excelserialdate excelserialday exceldatenumber serialdate serialdatenumber
        oledate gpssow missiontime ts met
        missionelapsedtime gmt gmttime localtime timecode smpte ltc vitc hms hhmmss hhmmssmmm ticks filetime
        secondsaftermidnight
        secondspastmidnight secondssincemidnight secspastmidnight secpastmidnight secsaftermidnight
        timepastmidnight timeaftermidnight timesincemidnight utcofposition timez zulutime
        zeit uhrzeit horodatage temps heure heuretu heureutc heuretuc instant tiempo
        hora horautc tempo ora orautc czas czasutc tid tidspunkt tijd tijdstip aika ido cas zaman saat время времяutc
        час 时间 時間 時刻 时刻 시간 시각
        """
    ),
    "range": _split(
        """
        range r slantrange sr rng rho slrange slrng slantrng srange srng entfernung entf schragentfernung
        schragdistanz schragdist schragstrecke schraegstrecke schraegentfernung schraegdistanz schraegdist
        distanceoblique distanceinclinee distanceradiale distanciainclinada distanciageometrica distanciaobliqua
        alcance alcanceinclinado alcanceobliquo distanciageometrica distanzaobliqua distanzainclinata distanzaradiale
        portee porteeoblique schuineafstand snedavstand skraavstand skraafstand lutandeavstand sikmadalka
        sikmavzdalenost odlegloscskosna odlegloscpochyla ferdetavolsag vinoetaisyys egikmesafe egikmenzil menzil
        дальность наклоннаядальность дальностьнаклонная расстояниенаклонное наклонноерасстояние дальністьпохила
        похиладальність дальність 斜距 斜距离 斜距離 直线距离 경사거리 사거리
        """
    ),
    "azimuth": _split(
        """
        azimuth az a azimuthangle azangle azim azi azmth azm bearing brg azimut acimut azymut azimute gisement
        azimutal angleazimutal angleazimut anguloazimutal angoloazimutale azimutti azimutwinkel baring peilung peiling
        seitenwinkel relevement rilevamento marcacion marcacao namiar kattazimutu yonacisi istikamet istikametacisi
        semt semtacisi азимут уголазимута пеленг 方位角 方位 水平角 방위각 방위
        demora pejling suuntima kerteriz seitenpeilung katkursowy курсовоиугол 舷角 真方位 相对方位 相対方位
        """
    ),
    "elevation": _split(
        """
        elevation el e elevationangle elangle elev elevangle altitudeangle hohenwinkel hoehenwinkel elevationswinkel
        elevacion elevazione elevacao elevatie elewacja elevace angledelevation anglesite angledesite angulodeelevacion
        anguloelevacion angulodesituacion anguloelevacao angulodeelevacao angolodielevazione angoloelevazione
        angolodisito angolosito elevatiehoek hojdvinkel hoydevinkel hojdevinkel elevationsvinkel korkeuskulma
        emelkedesiszog lagewinkel katpodniesienia katelewacji katwzniesienia elevacniuhel vyskovyuhel polohovyuhel
        unghideelevatie yukselis yukselisacisi
        уголместа уголвозвышения кутмісця 俯仰角 俯仰 仰角 高低角 高度角 고각 앙각 고도각
        """
    ),
}

#: Names of what a log may hold beside, by quantity; see `files.reading.further`.
FURTHER_ALIASES: Mapping[str, tuple[str, ...]] = {
    "height": _split(
        """
        height altitude alt flightlevel fl modec modecaltitude modecheight baroaltitude baroalt baroheight
        barometricaltitude barometricheight pressurealtitude geoaltitude geoheight geometricaltitude
        geometricheight heightmsl altitudemsl altmsl mslheight mslaltitude hohe flughohe flugflache hoogte
        altitud altura quota vyska yukseklik высота эшелон 高度 飞行高度层
        """
    ),
    "range_rate": _split(
        """
        rangerate rrate rdot rhodot rrdot rangedot rngrate rngdot slantrangerate srrate rr doppler dopplervelocity
        dopplerspeed radialvelocity radialspeed radialvel radialrate velocityradial radvel vradial vr vrad vlos
        rangevelocity losvelocity lineofsightvelocity drdt drangedt
        openingspeed openingvelocity openingrate closingspeed
        closingvelocity closingrate closurerate closurespeed radialgeschwindigkeit entfernungsanderung
        vitesseradiale velocidadradial velocitaradiale радиальнаяскорость 径向速度 径向速率 視線速度 시선속도
        """
    ),
    "signal": _split(
        """
        signal signalstrength signallevel signalpower strength snr sn signaltonoise signaltonoiseratio rssi cn0 echo
        rxlevel receivedlevel peakpower
        echostrength echolevel echopower power receivedpower rxpower returnpower returnstrength amplitude agc
        signalstarke signalpegel empfangspegel отношениесигналшум уровеньсигнала 信噪比 信号强度
        """
    ),
}

#: Names of depths, which are heights of targets below the water with the opposite sign, or those of the water itself.
DEPTHS = frozenset(
    _split("depth tiefe profondeur profundidad profundidade profondita diepte dybde djup dyp глубина глибина 深度")
)

#: Names that other things have too: used where no column has one of ALIASES.
WEAK_ALIASES: Mapping[str, tuple[str, ...]] = {
    "time": ("date", "gpst", "daytime"),
    "range": _split(
        """
        dist dst rdst sd distance slantdistance slopedistance slopedist slant distanz distancia distanza odleglosc
        strecke abstand avstand afstand mesafe vzdalenost tavolsag etaisyys расстояние д d 距离 距離 거리
        """
    ),
    "azimuth": _split(
        """
        theta rdir hz hr richtung horizontalwinkel horizontalrichtung horizontalangle horizontaldirection hzangle hangle
        ha horangle horizangle horizontalvinkel anglehorizontal angulohorizontal angoloorizzontale kathorizontalny аз β
        """
    ),
    "elevation": _split(
        """
        v h ele vertikalwinkel verticalangle vertangle vangle va elv alt altitude site sito situ depression
        depressionangle dipangle tiefenwinkel lookdownangle downangle ум ε
        """
    ),
}

#: Words beside a name of the time that say whose it is, and from when it counts: `log_time`, `time since boot`.
OF_TIMES = frozenset(
    _split(
        """
    unix posix utc gps gmt local system sys host pc cpu computer server client logger sensor radar plot track target
    log logged record recorded recording rec recv received receive rx reception acquisition acq capture captured
    measurement measured meas sample sampled sampling observation obs event frame packet message msg data
    since from after of start begin launch liftoff takeoff release boot power on origin epoch zero t0 rel relative
    elapsed decimal mission test run day week midnight sec secs second seconds
    """
    )
)

#: Weak aliases that need a unit, because alone they are a height, a place or anything.
ONLY_BY_UNIT = ("alt", "ele", "altitude", "site", "sito", "situ", "d", "д", "h", "hr", "z", "vz", "β", "ε")

#: Names of angles of which none says whether it is the azimuth, and from where the other one counts.
EITHER_ANGLE = ("theta", "phi", "psi", "alpha", "θ", "φ", "ψ", "α", "beta", "β", "pan", "tilt")

#: Names in German, in which Grad are degrees, and sm Seemeilen.
GERMAN = frozenset(
    _split(
        "zeit uhrzeit entfernung entf schragentfernung schragdistanz hohenwinkel distanz abstand peilung seitenpeilung"
    )
)

#: Names of zenith angles, which are 90 degrees minus the elevation.
ZENITH_ALIASES = _split(
    """
    z vz zenith zenithangle zenithdistance zen zd za zendist zenang zenithdist zenit zenitdistanz zenitwinkel
    coelevation coelevationangle offzenithangle offzenith colatitude zenithal zenithale zenital zenitale cenital
    zenitalna zenitalny zenitavstand zenithoek zenithafstand зенитноерасстояние зенитныи 天顶距 天頂距 天顶角 天頂角
    """
)

#: Names of angles below the horizontal.
DEPRESSIONS = ("depression", "depressionangle", "dip", "dipangle", "tiefenwinkel", "lookdownangle", "downangle")

#: Words of an azimuth that counts from true north, beside `true`.
TRUE = frozenset(
    _split(
        """
    vrai vraie vero vera verdadero verdadera verdadeiro verdadeira rechtweisend rechtweisende rw wahre hakiki
    rzeczywisty ware истинныи
    """
    )
)

#: Words of a name that say nothing about the quantity.
QUALIFIERS = frozenset(
    _split(
        """
    measured meas raw obs observed target tgt track trk radar sensor tracker polar value angle reading laser
    instrument theodolite anchor aoa rot rotor rotator antenna ant the true los look to from corrected station angular
    actual act ist istwert gemessen mesure mesuree medido medida misurato angulo angolo kat угол
    """
    )
).union(TRUE)

#: Words that make a column something other than the quantity; they are not unknown units.
NOT_UNITS = frozenset(
    _split(
        """
    rate dot sigma std err error bias res residual flag valid snr rcs ok quality id status type gate ref mps2
    mode sd var variance rms outlier velocity speed vel doppler acc cmd command commanded offset corr lag
    correction width beamwidth max min ground horizontal cov uncertainty idx index count no number code lock
    signal power servo encoder enc counts raw true truth
    soll sollwert setpoint consigne
    filt filtered smooth smoothed pred predicted prediction sac sic cat category fl typ len trn tn
    """
    )
)

#: Words of columns that hold counts of an encoder.
COUNTS = frozenset(_split("counts count cnt cnts ticks encoder encoders enc"))
#: Words of a name with a unit that say nothing about the quantity.
BESIDE_A_UNIT = QUALIFIERS | COUNTS

#: Names of azimuths that count from the head of a ship, on land from the north of a grid; so do gunners and surveyors.
AT_SEA = "gisement"

#: Words of courses, of a carrier or a target; and of speeds, with which a course may be that of a target.
COURSES = frozenset(_split("course kurs rumbo rumo koers rota rotta route курс 航向"))
SPEEDS = frozenset(
    _split("speed velocity sog fahrt geschwindigkeit vitesse velocidad velocidade velocita snelheid fart скорость 航速")
)

#: What an azimuth may count from beside an axis or true north: words of its name, its mark behind the unit, and words
#: of the column that is to be added to it.
TURNED = {
    "the head of the carrier": (
        frozenset(
            (
                *_split("relative rel body bow relativo relativa relatif relativ polare boegpeiling nispi katkursowy"),
                *_split("seitenpeilung marcacion курсовоиугол курсовои относительныи 舷角 相对方位 相対方位"),
                AT_SEA,
            )
        ),
        "R",
        COURSES.union(_split("heading hdg yaw cap prora proa steuerkurs 船首向 艏向")),
    ),
    "magnetic north": (
        frozenset(_split("magnetic mag compass")),
        "M",
        frozenset(_split("variation declination magvar")),
    ),
}


#: Words of columns that are neither a time, a range nor an angle from a station.
OTHER_THINGS = frozenset(
    _split(
        """
    lat latitude lon lng long longitude breite breitengrad laenge lange langengrad height hgt alt altitude hohe
    hoehe x y z east north up easting northing down ra dec declination rightascension
    vx vy vz ax ay az_rate speed velocity vel course cog sog heading hdg roll pitch yaw rate dot
    id sensor sensorid station code mode squawk icao callsign target track trackid number no index idx count
    date day month year hour minute min second sec hours minutes
    snr rcs db power amplitude mag magnitude temp temperature pressure humidity voltage battery quality status flag
    fl flightlevel pred predicted prediction cmd command commanded soll sollwert setpoint consigne
    variation declination magvar hd horizontal ground vertical vd
    remark remarks comment comments note notes name label text info description operator prism
    """
    )
).union(*(added for _, _, added in TURNED.values()))


#: Words of columns that count frames, samples or rows.
FRAMES = frozenset(
    _split(
        """
    frame frames sample samples index idx n no nr num number id count counter seq sequence row point record scan image
    picture bild pulse cycle sweep video camera
    """
    )
)

#: Words of a column that holds the readings of another after a correction, or the correction itself.
CORRECTED = frozenset(_split("corr corrected calibrated cal compensated comp refined adjusted"))

#: Cells that mean "no reading", beside the empty cell.
MISSING_WORDS = (
    *("", "NaN", "nan", "NAN", "-NaN", "-nan", "NA", "N/A", "n/a", "#NA", "#N/A", "#N/A N/A", "<NA>"),
    *("NULL", "Null", "null", "None", "none", "1.#IND", "-1.#IND", "1.#QNAN", "-1.#QNAN"),
)

_LETTERS = str.maketrans({"ł": "l", "ı": "i", "ø": "o", "đ": "d", "æ": "ae", "ß": "ss"})  # that have no parts

#: Words in brackets behind a name that change nothing, beside units and what the name itself may say.
HARMLESS = frozenset(
    _split(
        """
    above after and angle anti anticlockwise at azimuth bearing by ccw clockwise counter counterclockwise cw day
    dd decimal deg degrees distance double e east elapsed elevation epoch float from geodetic geographic gmt gps
    grid hh horizon horizontal in int integer itow launch local los lst midnight mm mod modulo ms n nominal
    north of one oneway or over positive posix range real relative sec seconds since single sl slant slope sod
    ss start tai the time to tod tow unit units unix unwrapped up upward upwards ut utc way week wgs with
    wrapped x yy yyyy z zero
    """
    )
).union(QUALIFIERS, CORRECTED, ZENITH_ALIASES, *(words for words, _, _ in TURNED.values()))


def plain_letters(text: str) -> str:
    """Small letters without accents."""
    bare = "".join(
        letter for letter in unicodedata.normalize("NFKD", text).lower().translate(_LETTERS)
        if not unicodedata.combining(letter)
    )  # fmt: skip
    return unicodedata.normalize("NFC", bare)
